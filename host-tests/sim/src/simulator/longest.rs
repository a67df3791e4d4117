//! Longest possible chains: relays in ascending order, each linked with the next.

/// Largest number of chains returned; sparse links can allow far more.
const MOST: usize = 1_000;

/// Returns the length of the longest chains, and those chains whose members all satisfy `with`.
///
/// `on` lists the relays in ascending order, from 0; `links` returns true for two linked relays, the lower one first. At most
/// 1000 chains are returned.
pub fn longest(
    on: &[usize],
    links: impl Fn(usize, usize) -> bool,
    with: impl Fn(usize) -> bool,
) -> (usize, Vec<Vec<usize>>) {
    let onward: Vec<Vec<usize>> = (0..on.len())
        .map(|at| {
            let later = at + 1..on.len();
            later
                .filter(|next| matches!((on.get(at), on.get(*next)), (Some(one), Some(other)) if links(*one, *other)))
                .collect()
        })
        .collect();
    let mut lengths = vec![1_usize; on.len()];
    for (at, next) in onward.iter().enumerate().rev() {
        let beyond = next.iter().filter_map(|next| lengths.get(*next).copied());
        let most = beyond.max().unwrap_or(0);
        if let Some(length) = lengths.get_mut(at) {
            *length = most + 1;
        }
    }
    let length = lengths.iter().copied().max().unwrap_or(0);
    let is = |at: &usize, length: usize| {
        lengths.get(*at) == Some(&length) && on.get(*at).is_some_and(|one| with(*one))
    };
    let mut ways: Vec<Vec<usize>> = (0..on.len())
        .filter(|at| is(at, length))
        .map(|at| vec![at])
        .collect();
    for left in (1..length).rev() {
        ways = ways
            .iter()
            .flat_map(|way| {
                let next = way.last().and_then(|last| onward.get(*last));
                let next = next.into_iter().flatten().filter(|at| is(at, left));
                next.map(|at| [way.as_slice(), &[*at]].concat())
            })
            .take(MOST)
            .collect();
    }
    let named = |way: Vec<usize>| {
        way.into_iter()
            .filter_map(|at| on.get(at).copied())
            .collect()
    };
    (length, ways.into_iter().map(named).collect())
}

#[cfg(test)]
mod tests {
    use super::longest;

    fn near(one: usize, other: usize) -> bool {
        one.abs_diff(other) <= 4
    }

    #[test]
    fn where_all_hear_their_neighbours_all_are_in_the_chain() {
        let on: Vec<usize> = (0..8).collect();
        assert_eq!(longest(&on, near, |_| true), (8, vec![on.clone()]));
        let left = [0, 1, 4, 5, 7];
        assert_eq!(longest(&left, near, |_| true), (5, vec![left.to_vec()]));
        assert_eq!(longest(&[], near, |_| true), (0, vec![]));
    }

    #[test]
    fn of_two_neighbours_that_are_not_linked_one_is_left_out() {
        let on: Vec<usize> = (0..8).collect();
        let links = |one, other| near(one, other) && (one, other) != (2, 3);
        let (length, ways) = longest(&on, links, |_| true);
        assert_eq!(length, 7);
        assert_eq!(ways, [[0, 1, 2, 4, 5, 6, 7], [0, 1, 3, 4, 5, 6, 7]]);
        // Relay 2 has no position, so only the chain without it qualifies.
        let (length, ways) = longest(&on, links, |at| at != 2);
        assert_eq!((length, ways), (7, vec![vec![0, 1, 3, 4, 5, 6, 7]]));
    }

    #[test]
    fn parts_that_do_not_hear_each_other_are_chains_of_their_own() {
        let on: Vec<usize> = (0..8).collect();
        let halves = |one: usize, other: usize| near(one, other) && (one < 4) == (other < 4);
        let both = longest(&on, halves, |_| true);
        assert_eq!(both, (4, vec![vec![0, 1, 2, 3], vec![4, 5, 6, 7]]));
        let parts = |one: usize, other: usize| near(one, other) && (one < 3) == (other < 3);
        assert_eq!(
            longest(&on, parts, |_| true),
            (5, vec![vec![3, 4, 5, 6, 7]])
        );
        // The five missing relays in a row leave a gap beyond radio range.
        assert_eq!(longest(&[0, 1, 7], near, |_| true).1, [[0, 1]]);
    }

    #[test]
    fn however_many_ways_there_are_only_some_are_looked_at() {
        let on: Vec<usize> = (0..60).collect();
        // Twenty groups of three; each chain takes any one relay of each group.
        let links = |one: usize, other: usize| other / 3 == one / 3 + 1;
        let (length, ways) = longest(&on, links, |_| true);
        assert_eq!(length, 20);
        assert!(ways.len() == 1_000);
    }
}

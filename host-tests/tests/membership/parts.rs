//! Split chains, and links that come and go.

use super::*;

/// Returns the relays that continue after a chain of eight is split after relay `after`. They are the majority, or
/// the half with the leader.
fn goes_on(after: u16) -> Vec<u16> {
    if after >= 4 {
        (1..=after).collect()
    } else {
        (after + 1..=8).collect()
    }
}

#[test]
fn the_larger_part_of_a_split_chain_goes_on() {
    for after in 1..8 {
        let mut setup = paper(8);
        setup.partitions = vec![Partition {
            after,
            from: seconds(20),
            until: None,
        }];
        setup.deadline = seconds(120);
        let before = ledger::undisturbed(&setup, &ALL, *setup.mission.config()).bits();
        let on = goes_on(after);
        let outcome = settles(&setup, &on, &format!("after {after}"));
        for index in (1..=8).filter(|index| !on.contains(index)) {
            let at = usize::from(index) - 1;
            assert_eq!(outcome.bits()[at], before[at], "{index} has left its place");
        }
    }
}

#[test]
fn without_the_quorum_rule_both_parts_go_on() {
    let mut setup = paper(8);
    setup.settings.quorum = false;
    setup.partitions = vec![Partition {
        after: 5,
        from: seconds(20),
        until: None,
    }];
    go_on_until(&mut setup, seconds(60));
    setup.deadline = seconds(61);
    let outcome = run(setup.clone()).unwrap();
    judge(&setup, &outcome, &[1, 2, 3, 4, 5]).unwrap();
    judge(&setup, &outcome, &[6, 7, 8]).unwrap();
}

#[test]
fn a_split_chain_heals() {
    for after in 1..8 {
        for healed in [22, 31, 45, 100] {
            let mut setup = paper(8);
            setup.partitions = vec![Partition {
                after,
                from: seconds(20),
                until: Some(seconds(healed)),
            }];
            setup.deadline = seconds(healed + 120);
            settles(&setup, &ALL, &format!("after {after} until {healed} s"));
        }
    }
}

/// Returns the largest number of views that one relay accepts while a link goes down and up. A view is a membership
/// of the chain.
///
/// The link leads from relay `after` to the next relay toward Rx. Its state changes every `half` seconds, for ten minutes of simulated
/// time.
fn flaps(half: u64, after: u16) -> usize {
    let mut setup = paper(8);
    for n in 0..600 / (2 * half) {
        setup.partitions.push(Partition {
            after,
            from: seconds(20 + 2 * half * n),
            until: Some(seconds(20 + 2 * half * n + half)),
        });
    }
    setup.deadline = seconds(620 + 600);
    let outcome = settles(&setup, &ALL, &format!("{half} s, after {after}"));
    (1..=8).map(|index| views(&outcome, index)).max().unwrap()
}

#[test]
fn a_flapping_link_disturbs_the_chain_less_and_less() {
    for half in [1, 4, 8, 14, 16, 20, 30, 50] {
        let views: Vec<_> = (1..8).map(|after| flaps(half, after)).collect();
        println!(
            "down and up for {half} s each: the chain forms anew {views:?} times in ten minutes"
        );
        // Short outages have no effect. Three losses are forgiven, at up to three views each; then the neighbour is accepted
        // after 15, 30, 60, 120, 240 s of reception, soon longer than the link stays up.
        let most = if half < 10 { 0 } else { 18 };
        assert!(
            views.iter().all(|views| *views <= most),
            "{half} s: {views:?}"
        );
    }
}

#[test]
fn a_settled_chain_on_a_good_channel_stays_unchanged() {
    let mut setup = paper(8);
    setup.kills = vec![(3, seconds(20))];
    go_on_until(&mut setup, seconds(3_600));
    setup.deadline = seconds(3_601);
    let outcome = run(setup.clone()).unwrap();
    let last = outcome.moments.last().unwrap().at;
    assert!(last < seconds(40), "{last:?}");
    judge(&setup, &outcome, &without(&[3])).unwrap();
}

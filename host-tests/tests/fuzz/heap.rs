//! Check of the heap counter, so that its zeros are meaningful.

use uav_relay_fuzz::heap::{asked, without};

#[test]
fn heap_allocations_are_counted() {
    let before = asked();
    let mut kept = Box::new(1);
    assert_eq!(asked() - before, 1);
    *kept += 1;
    let many = vec![0_u8; 1 << 20];
    assert_eq!(asked() - before, 2, "zeroed memory counts too");
    let mut text = String::from("a");
    text.push_str("nother");
    assert_eq!(asked() - before, 4, "and memory that grows");
    assert_eq!((*kept, many.len(), text.len()), (2, 1 << 20, 7));
}

#[test]
fn work_that_allocates_is_detected() {
    assert_eq!(without(|| 6 * 7), 42);
    let caught = std::panic::catch_unwind(|| without(|| vec![1_u8; 7]));
    assert!(caught.is_err());
}

//! Check of the heap counter, so that its zeros are meaningful.

use uav_relay_fuzz::heap::{allocations, without_allocation};

#[test]
fn heap_allocations_are_counted() {
    let before = allocations();
    let mut kept = Box::new(1);
    assert_eq!(allocations() - before, 1);
    *kept += 1;
    let many = vec![0_u8; 1 << 20];
    assert_eq!(allocations() - before, 2, "zeroed memory counts too");
    let mut text = String::from("a");
    text.push_str("nother");
    assert_eq!(allocations() - before, 4, "and memory that grows");
    assert_eq!((*kept, many.len(), text.len()), (2, 1 << 20, 7));
}

#[test]
fn work_that_allocates_is_detected() {
    assert_eq!(without_allocation(|| 6 * 7), 42);
    let caught = std::panic::catch_unwind(|| without_allocation(|| vec![1_u8; 7]));
    assert!(caught.is_err());
}

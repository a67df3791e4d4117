//! Check of the targets' input: numbers over their whole ranges.

use uav_relay_fuzz::input::Input;

#[test]
fn fuzz_input_reaches_both_ends_and_ends_in_zeros() {
    let (low, high) = (0.1_f32, 1e5_f32);
    assert_eq!(Input::new(&[0, 0]).scaled(low, high), low);
    assert_eq!(Input::new(&[255, 255]).scaled(low, high), high);
    assert_eq!(Input::new(&[0, 0]).even(-high, high), -high);
    assert_eq!(Input::new(&[255, 255]).even(-high, high), high);
    let mut input = Input::new(&[7]);
    assert_eq!((input.word(), input.is_empty(), input.byte()), (7, true, 0));
    assert_eq!(Input::new(&[9, 1, 2]).piece(), [1, 2]);
}

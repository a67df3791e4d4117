//! Legend of colours and symbols.

use super::canvas::Canvas;
use super::hops::CLASSES;
use super::nodes::cross;
use super::picture::{Picture, bottom};
use super::sources::{diamond, has_beside};

pub(super) fn draw(canvas: &mut Canvas, picture: &Picture) {
    let row = bottom(picture) - 27.0;
    canvas.text((24.0, row + 3.6), "start", "Hop SIR above the worst hop's:");
    for ((_, colour, width, words), left) in CLASSES.into_iter().zip([188.0, 264.0, 333.0, 402.0]) {
        canvas.swatch((left, row), 18.0, (colour, width));
        canvas.text((left + 22.0, row + 3.6), "start", words);
    }
    let row = bottom(picture) - 10.0;
    canvas.text((24.0, row + 3.6), "start", "Numbers at hops: SIR in dB");
    canvas.disc((180.0, row), 4.0, "relay");
    canvas.text((192.0, row + 3.6), "start", "relay");
    let silent = !picture.lost.is_empty();
    if silent || !picture.left_out.is_empty() {
        canvas.disc((240.0, row), 4.0, "relay lost");
        cross(canvas, (240.0, row), 5.5);
        let words = if silent { "silent" } else { "lost" };
        canvas.text((252.0, row + 3.6), "start", words);
    }
    if picture.interferers.is_empty() {
        return;
    }
    canvas.shape(&diamond((306.0, row)), "source");
    canvas.text((316.0, row + 3.6), "start", "interferer");
    if has_beside(picture) {
        canvas.shape(&diamond((384.0, row)), "beside");
        canvas.text((394.0, row + 3.6), "start", "beside the line");
    }
}

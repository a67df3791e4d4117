//! Contents of a drone's flash: epoch, uploaded missions, and votes on views.

mod epoch;
mod journal;
mod uploads;
mod views;

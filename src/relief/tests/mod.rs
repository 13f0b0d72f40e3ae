//! Contours against exact predicates, distance transforms and transcriptions of the paper; hostile input.

mod fourier;
mod input;
pub(crate) mod oracle;
pub(crate) mod rings;
mod shapes;

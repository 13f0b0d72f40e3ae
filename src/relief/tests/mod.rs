//! Contours against exact predicates, distance transforms and transcriptions of the paper; hostile input.

mod fourier;
mod input;
mod oracle;
mod rings;
mod shapes;

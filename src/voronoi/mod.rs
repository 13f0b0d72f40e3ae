//! Cracks that draw a picture.
mod lattice;
mod search;
#[cfg(test)]
mod tests;

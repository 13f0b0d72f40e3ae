//! What the crate promises, from the outside. One binary, one module a subject; a new test goes to the module it fits or to a
//! new one beside them, never to a further file directly in `tests/` (each of those would link the engine again).

mod pictures;

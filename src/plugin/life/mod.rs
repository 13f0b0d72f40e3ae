//! What happens to a surface from outside: healing, changed components and pictures, the end of its entity.

pub(crate) mod change;
pub(crate) mod commands;
pub(crate) mod heal;
pub(crate) mod record;
pub(crate) mod script;
pub(crate) mod watch;

//! Shattering: pieces, their flight, their way back.
//!
//! What falls out is an entity each, a child of its surface, in the mesh of [`Shards::flat_mesh`](crate::shatter::Shards::flat_mesh) or
//! [`Shards::solid_mesh`](crate::shatter::Shards::solid_mesh), or of what is not flat [`Shards::shell_mesh`](crate::shatter::Shards::shell_mesh). The surface's diffuse texture is transparent where it was; the shards show a
//! copy without holes. A background task makes all that needs no world (`order`, `form`), and a frame applies it (`release`). Where a
//! shard is, is a function of the time since the surface broke first (`fly`), so time may run at any speed, backwards, or jump. Entities and
//! meshes of shards that are gone serve for others (`body`, `show`).

mod batch;
pub(crate) mod body;
pub(crate) mod broken;
pub(crate) mod chips;
mod crumbs;
mod drawn;
pub(crate) mod fly;
mod form;
mod order;
pub(crate) mod release;
pub(crate) mod request;
mod shell;
mod show;
mod spans;
mod throw;

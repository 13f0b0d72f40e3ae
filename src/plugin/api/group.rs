//! [`CrackMemberOf`] and [`CrackGroup`]: sprites, tile maps and meshes that crack as one surface.

use bevy::prelude::*;

/// Makes a sprite, a chunk of a tile map, or a mesh in 3D, part of a surface that cracks as one: a wall of tiles, a row of props, a room.
///
/// The group is an entity with a [`CrackSurface`](super::CrackSurface) and no sprite or mesh of its own. Its members are what is shown until something
/// hits the group. Then a background task puts their pictures together, the cracks grow over all of it, and the group shows that in their
/// place. Everything that a surface can do, a group can: clocks, [`CrackState`](super::CrackState), cells, guided cracks, shards, healing.
/// Healing shows the members again.
///
/// A hit on a member counts as one on its group: at a point of the world, or at a `uv` of the member. A hit on the group is at a point of the
/// world, or at a `uv` of the rectangle around all members.
///
/// | member | |
/// |---|---|
/// | `Sprite` | a whole picture, a `rect` or a frame of an atlas; flipped, tinted, of any size and anchor; not sliced or tiled |
/// | `TilemapChunk` | all tiles, in any orientation, tinted, hidden; the tileset is read from the CPU |
/// | `Mesh3d` with a `StandardMaterial` | any list of triangles; with its picture, normal map, `uv_transform` and base color |
///
/// # Sprites and tile maps
///
/// Members lie anywhere in the group's plane, turned by quarter turns against it, whatever their parents are; their z says who covers whom. The
/// group is drawn at its own z. Its picture has the texels of the member that is finest, 4096 a side at the most. No crack runs where no member
/// is, unless [`CrackSurface::alpha_mask`](super::CrackSurface::alpha_mask) is off. The patterns of presets are made for
/// surfaces whose shorter side is a unit, so a whole level needs [`CrackPreset::scaled`](crate::CrackPreset::scaled).
///
/// While there are cracks, a member that goes, or moves, leaves a hole and the cracks of the others as they are; one that moves is shown by
/// itself again, without cracks. One whose picture changes is shown with the new one. One that comes, or lies outside the rectangle, cracks with
/// the others after the group has been healed. Each of these changes makes the picture of the group anew, in the background: not for
/// members whose pictures change all the time.
///
/// # Meshes in 3D
///
/// Members lie anywhere in space, turned and scaled as they like. Where edges of two of them lie on one another, all along or in part, cracks run
/// from one over to the other: from a wall over the floor, up a flight of stairs. The group is laid out flat around the first hit, as a box is, see
/// [`CrackUnwrap`](super::CrackUnwrap), with the texels of the member that is finest, or fewer where that would be too many. All else of
/// its material, such as the roughness, is that of the first member. It has no vertex colours and no maps but those two. It shatters as a shell.
/// `CrackUnwrap::Always` allows for more texels; `Never` is as `Auto`.
///
/// A member that goes or moves leaves a gap, and the cracks of the others as they are. One that comes, or shows something else, does so
/// after the group has been healed.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn build(mut commands: Commands, assets: Res<AssetServer>) {
///     let wall = commands.spawn(CrackSurface::new(CrackPreset::BRICK)).id();
///     for i in 0..96 {
///         let place = Transform::from_xyz(64.0 * (i % 12) as f32, 64.0 * (i / 12) as f32, 0.0);
///         commands.spawn((Sprite::from_image(assets.load("tile.png")), place, CrackMemberOf(wall)));
///     }
/// }
/// # bevy::ecs::system::assert_is_system(build);
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Clone, Debug, PartialEq)]
#[relationship(relationship_target = CrackGroup)]
pub struct CrackMemberOf(
    /// The group.
    #[entities]
    pub Entity,
);

/// Of no group yet.
impl Default for CrackMemberOf {
    fn default() -> Self {
        Self(Entity::PLACEHOLDER)
    }
}

/// The members of a surface that is put together from some: entities with [`CrackMemberOf`]. It is there while there are any.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::prelude::*;
///
/// fn count(groups: Query<(&Name, &CrackGroup)>) {
///     for (name, members) in &groups {
///         info!("{name} has {} members", members.iter().count());
///     }
/// }
/// # bevy::ecs::system::assert_is_system(count);
/// ```
#[derive(Component, Reflect, Default, Debug, PartialEq, Eq)]
#[type_path = "bevy_crack"]
#[reflect(Component, Default, Debug, PartialEq)]
#[relationship_target(relationship = CrackMemberOf)]
#[require(Transform, Visibility)]
pub struct CrackGroup(Vec<Entity>);

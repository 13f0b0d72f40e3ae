//! Where everything is: the exhibits fill what the panel leaves free of the window.

use bevy::{camera::Viewport, prelude::*};
use bevy_crack::editor::CrackEditor;

/// A rectangle from its middle and its size.
const fn rect(x: f32, y: f32, width: f32, height: f32) -> Rect {
    Rect { min: Vec2::new(x - 0.5 * width, y - 0.5 * height), max: Vec2::new(x + 0.5 * width, y + 0.5 * height) }
}

/// The pane, the wall, the view of the wall in 3D and the choice of materials, in the world of the 2D camera.
pub(crate) const PANE: Rect = rect(-219.0, 113.0, 420.0, 420.0);
pub(crate) const WALL: Rect = rect(219.0, 113.0, 420.0, 420.0);
pub(crate) const WALL_3D: Rect = rect(-219.0, -219.0, 420.0, 208.0);
pub(crate) const CHOICE: Rect = rect(219.0, -219.0, 420.0, 208.0);

/// Size of all of them, and the room around them.
const ALL: Vec2 = Vec2::new(858.0, 646.0);
const MARGIN: f32 = 18.0;

/// What the panel takes at the right, and the page's line of help at the bottom, logical pixels.
const PANEL: f32 = 364.0;
const HELP: f32 = 30.0;

/// A window that is less wide is no place for a panel beside the exhibits.
const NARROW: f32 = 820.0;

/// The camera that looks at the wall in 3D.
#[derive(Component)]
pub(crate) struct View3d;

/// Turns both cameras to the free part of the window.
pub(crate) fn fit(
    window: Single<&Window>,
    editor: Res<CrackEditor>,
    flat: Single<(&mut Transform, &mut Projection), With<Camera2d>>,
    mut view: Single<&mut Camera, With<View3d>>,
    mut last: Local<Option<(Vec2, f32, bool)>>,
) {
    let size = window.size();
    let now = (size, window.scale_factor(), editor.is_open);
    if *last == Some(now) || size.min_element() < 1.0 {
        return;
    }
    *last = Some(now);
    let panel = if editor.is_open && size.x >= NARROW { PANEL } else { 0.0 };
    let free = (size - Vec2::new(panel, HELP)).max(Vec2::ONE);
    // World units for each logical pixel.
    let scale = (ALL / (free - 2.0 * MARGIN).max(Vec2::ONE)).max_element();
    let (mut transform, mut projection) = flat.into_inner();
    // The middle of the window is to the right of the middle of its free part, and below it.
    let middle = 0.5 * scale * Vec2::new(panel, -HELP);
    transform.translation = middle.extend(transform.translation.z);
    if let Projection::Orthographic(projection) = &mut *projection {
        projection.scale = scale;
    }
    let to_pixel = |at: Vec2| {
        let logical = 0.5 * size + (at - middle) / scale * Vec2::new(1.0, -1.0);
        (logical * window.scale_factor()).round().max(Vec2::ZERO).as_uvec2().min(window.physical_size())
    };
    let (min, max) =
        (to_pixel(Vec2::new(WALL_3D.min.x, WALL_3D.max.y)), to_pixel(Vec2::new(WALL_3D.max.x, WALL_3D.min.y)));
    let physical_size = max.saturating_sub(min).max(UVec2::ONE);
    view.viewport = Some(Viewport { physical_position: min, physical_size, ..default() });
}

//! What is drawn over the chosen surface: its network, markers, cells, and what was painted again.

use super::{panel::Overlays, state::CrackEditor};
use crate::plugin::{CrackPlaces, CrackState, inspect};
use bevy::{ecs::system::SystemState, prelude::*};
use bevy_egui::egui::{self, Color32, Painter, Pos2, Stroke};

/// The most lines, and the most markers, that are drawn.
const MOST: usize = 20_000;

/// Frames that a rectangle is shown after it was painted.
const LASTS: u32 = 14;

/// A rectangle that was painted, texture coordinates, and how long it is shown yet, frames.
pub(super) struct Flash {
    rect: [Vec2; 2],
    left: u32,
}

/// Notes which rectangles of the chosen surface were painted in this frame.
pub(super) fn note_dirty(world: &mut World) {
    let Some(editor) = world.get_resource::<CrackEditor>() else { return };
    let rects = match editor.chosen {
        Some(chosen) if editor.panel.overlays.dirty => inspect::dirty_rects(world, chosen),
        _ => Vec::new(),
    };
    if let Some(mut editor) = world.get_resource_mut::<CrackEditor>() {
        editor.flashes.retain_mut(|flash| {
            flash.left = flash.left.saturating_sub(1);
            flash.left > 0
        });
        editor.flashes.extend(rects.into_iter().map(|rect| Flash { rect, left: LASTS }));
    }
}

/// Draws over the scene and below the panel.
pub(super) fn draw(world: &mut World, ctx: &egui::Context, editor: &mut CrackEditor) {
    let Some(chosen) = editor.chosen else { return };
    let overlays = editor.panel.overlays;
    if overlays == Overlays::default() {
        return;
    }
    let Some(onto) = Onto::of(world, chosen) else { return };
    let painter = ctx.layer_painter(egui::LayerId::background());
    if overlays.cells {
        draw_cells(&painter, &onto, &inspect::cells(world, chosen));
    }
    if overlays.network {
        for line in inspect::lines(world, chosen, MOST) {
            let [a, b] = line.ends.map(|end| onto.pos(end));
            painter.line_segment([a, b], Stroke::new(1.5, age(line.birth)));
        }
    }
    if overlays.markers {
        for marker in inspect::markers(world, chosen, MOST) {
            painter.circle_filled(onto.pos(marker), 1.5, Color32::from_rgb(90, 220, 120));
        }
    }
    if overlays.radii {
        for [reach, kill] in inspect::circles(world, chosen) {
            for (ring, color) in [(reach, Color32::from_rgb(255, 210, 80)), (kill, Color32::from_rgb(255, 90, 90))] {
                painter.line(ring.into_iter().map(|uv| onto.pos(uv)).collect(), Stroke::new(1.0, color));
            }
        }
    }
    if overlays.tips
        && let Some(state) = world.get::<CrackState>(chosen)
    {
        for tip in &state.tips {
            let from = onto.pos(tip.uv);
            let ahead = onto.pos(tip.uv + 0.02 * tip.direction) - from;
            painter.arrow(from, ahead, Stroke::new(2.0, Color32::from_rgb(255, 120, 30)));
        }
    }
    for flash in &editor.flashes {
        let [min, max] = flash.rect;
        let corners = [min, Vec2::new(max.x, min.y), max, Vec2::new(min.x, max.y)];
        let alpha = (200 * flash.left / LASTS) as u8;
        let stroke = egui::epaint::PathStroke::new(1.0, Color32::from_rgba_unmultiplied(80, 160, 255, alpha));
        painter.add(egui::epaint::PathShape::closed_line(corners.map(|uv| onto.pos(uv)).into(), stroke));
    }
}

fn draw_cells(painter: &Painter, onto: &Onto, cells: &[Vec<Vec2>]) {
    for (i, cell) in cells.iter().enumerate() {
        // Neighbours differ: the hue goes on by the golden ratio.
        let hue = (i as f32 * 0.618_034).fract();
        let color: Color32 = egui::ecolor::Hsva::new(hue, 0.6, 0.95, 1.0).into();
        let points: Vec<Pos2> = cell.iter().map(|uv| onto.pos(*uv)).collect();
        painter.add(egui::epaint::PathShape::closed_line(points, Stroke::new(1.0, color)));
        let middle = cell.iter().fold(Vec2::ZERO, |sum, uv| sum + *uv) / cell.len() as f32;
        painter.circle(onto.pos(middle), 2.0, color, Stroke::NONE);
    }
}

/// Dark blue for the oldest, light yellow for the youngest.
fn age(birth: f32) -> Color32 {
    let t = birth.clamp(0.0, 1.0);
    let mix = |from: f32, to: f32| (from + t * (to - from)) as u8;
    Color32::from_rgb(mix(40.0, 255.0), mix(80.0, 240.0), mix(220.0, 120.0))
}

/// From texture coordinates to points on the screen. A flat surface is seen by a camera as by a projective map, which its four corners
/// fix.
struct Onto {
    /// Rows of a 3 x 3 matrix.
    rows: [[f32; 3]; 3],
}

impl Onto {
    /// How the first camera that sees all corners of a surface sees it.
    fn of(world: &mut World, entity: Entity) -> Option<Self> {
        let mut places = SystemState::<CrackPlaces>::new(world);
        let corners = {
            let places = places.get(world).ok()?;
            let corner = |u: f32, v: f32| places.at(entity, Vec2::new(u, v)).map(|place| place.position);
            [corner(0.0, 0.0)?, corner(1.0, 0.0)?, corner(1.0, 1.0)?, corner(0.0, 1.0)?]
        };
        let mut cameras = world.query::<(&Camera, &GlobalTransform)>();
        let mut cameras: Vec<_> = cameras.iter(world).filter(|(camera, _)| camera.is_active).collect();
        cameras.sort_by_key(|(camera, _)| camera.order);
        cameras.into_iter().find_map(|(camera, transform)| {
            let origin = camera.logical_viewport_rect()?.min;
            let mut seen = [Vec2::ZERO; 4];
            for (seen, corner) in seen.iter_mut().zip(corners) {
                *seen = camera.world_to_viewport(transform, corner).ok()? + origin;
            }
            Self::from_corners(seen)
        })
    }

    /// The projective map of the unit square's corners, clockwise from (0, 0), to these points; `None` if they enclose nothing
    /// (Heckbert 1989, section 2.2.3).
    fn from_corners([p00, p10, p11, p01]: [Vec2; 4]) -> Option<Self> {
        let (d1, d2, sum) = (p10 - p11, p01 - p11, p00 - p10 + p11 - p01);
        let area = d1.perp_dot(d2);
        if area.abs() < 1e-6 || !area.is_finite() {
            return None;
        }
        let (g, h) = (sum.perp_dot(d2) / area, d1.perp_dot(sum) / area);
        let (a, b) = (p10 - p00 + g * p10, p01 - p00 + h * p01);
        Some(Self { rows: [[a.x, b.x, p00.x], [a.y, b.y, p00.y], [g, h, 1.0]] })
    }

    fn pos(&self, uv: Vec2) -> Pos2 {
        let [x, y, w] = self.rows.map(|[a, b, c]| a * uv.x + b * uv.y + c);
        Pos2::new(x / w, y / w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_go_to_corners_and_lines_stay_straight() {
        let corners = [[10.0, 20.0], [200.0, 40.0], [180.0, 150.0], [30.0, 120.0]].map(Vec2::from);
        let onto = Onto::from_corners(corners).unwrap();
        let at = |u: f32, v: f32| {
            let pos = onto.pos(Vec2::new(u, v));
            Vec2::new(pos.x, pos.y)
        };
        for (corner, (u, v)) in corners.into_iter().zip([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) {
            assert!(at(u, v).distance(corner) < 1e-3, "{:?} {corner}", at(u, v));
        }
        // The diagonals meet where the middle is seen.
        let (p, r) = (corners[0], corners[2] - corners[0]);
        let (q, s) = (corners[1], corners[3] - corners[1]);
        let meeting = p + r * ((q - p).perp_dot(s) / r.perp_dot(s));
        assert!(at(0.5, 0.5).distance(meeting) < 1e-3);
        assert!(Onto::from_corners([Vec2::ZERO; 4]).is_none());
    }
}

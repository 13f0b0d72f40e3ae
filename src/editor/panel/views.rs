//! What is drawn over the surface, and its textures.

use super::settings::Overlays;
use bevy::math::UVec2;
use bevy_egui::egui::{self, TextureId, Ui};

pub(super) fn show_overlays(ui: &mut Ui, overlays: &mut Overlays) {
    for (shown, name, hint) in [
        (&mut overlays.network, "network", "Segments: the younger, the lighter."),
        (&mut overlays.tips, "tips", "Where cracks grow, and which way."),
        (&mut overlays.markers, "markers", "What attracts cracks."),
        (&mut overlays.radii, "reach and kill distance", "Around each hit."),
        (&mut overlays.cells, "cells", "Parts that cracks enclose."),
        (&mut overlays.dirty, "dirty rectangles", "Texels that have been painted again lately."),
    ] {
        ui.checkbox(shown, name).on_hover_text(hint);
    }
}

pub(super) fn show_textures(ui: &mut Ui, textures: &[(&'static str, TextureId, UVec2)]) {
    if textures.is_empty() {
        ui.weak("It has textures of its own once it is hit.");
    }
    ui.horizontal_wrapped(|ui| {
        for (name, texture, size) in textures {
            let scale = 144.0 / size.max_element().max(1) as f32;
            let shown = egui::vec2(size.x as f32, size.y as f32) * scale;
            ui.vertical(|ui| {
                ui.weak(*name);
                ui.image((*texture, shown)).on_hover_text(format!("{} x {} texels", size.x, size.y));
            });
        }
    });
}

//! Lines of text as pictures, so that the demos need no text renderer of the engine.

use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_crack::voronoi::{FONT, draw_text};

/// A line of text in a 2D scene, centred at the transform. Its colour is that of the sprite.
#[derive(Component, Clone, Debug)]
#[require(Sprite)]
pub struct Label {
    /// The line.
    pub text: String,
    /// Height of the letters, world units.
    pub height: f32,
}

impl Label {
    /// A line in grey.
    #[must_use]
    pub fn grey(text: impl Into<String>, height: f32, lightness: f32) -> impl Bundle {
        let color = Color::srgb(lightness, 1.03 * lightness, 1.07 * lightness);
        (Self { text: text.into(), height }, Sprite { color, ..default() })
    }
}

/// Draws labels that are new or have changed.
pub(crate) fn draw_labels(mut images: ResMut<Assets<Image>>, mut labels: Query<(&Label, &mut Sprite), Changed<Label>>) {
    for (label, mut sprite) in &mut labels {
        let letters = label.text.chars().count().max(1) as f32;
        let size = Vec2::new(0.8 * letters, 1.5) * label.height;
        // Two texels a unit, for screens with small pixels.
        let texels = (2.0 * size).ceil().as_uvec2();
        let Some(cover) = draw_text(FONT, &label.text, texels, 2.0 * label.height) else { continue };
        let rgba = cover.as_slice().iter().flat_map(|&cover| [255, 255, 255, (255.0 * cover) as u8]).collect();
        let extent = Extent3d { width: texels.x, height: texels.y, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba8UnormSrgb;
        sprite.image =
            images.add(Image::new(extent, TextureDimension::D2, rgba, format, RenderAssetUsages::RENDER_WORLD));
        sprite.custom_size = Some(size);
    }
}

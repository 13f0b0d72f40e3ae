//! Apps without a renderer, for tests that look inside.

use super::{CrackBudget, CrackPlugins};
use bevy::{
    asset::RenderAssetUsages,
    image::TextureAtlasLayout,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

/// Assets and time.
pub(super) fn app(budget: CrackBudget) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), ImagePlugin::default(), CrackPlugins))
        .init_asset::<TextureAtlasLayout>()
        .init_asset::<Mesh>()
        .init_asset::<ColorMaterial>();
    app.finish();
    app.cleanup();
    app.insert_resource(budget);
    app
}

/// A light grey picture.
pub(super) fn blank(size: UVec2) -> Image {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let (format, usage) = (TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::default());
    Image::new_fill(extent, TextureDimension::D2, &[200, 200, 200, 255], format, usage)
}

/// What the sprite shows.
pub(super) fn shown(app: &App, entity: Entity) -> Vec<u8> {
    let image = app.world().get::<Sprite>(entity).map(|sprite| sprite.image.clone()).unwrap_or_default();
    let images = app.world().resource::<Assets<Image>>();
    images.get(&image).and_then(|image| image.data.clone()).unwrap_or_default()
}

//! `StandardMaterial` shows cracks.

use super::slot::{CrackMaterial, MaterialSlot, SideLook};
use crate::plugin::api::textures::{CrackTextures, Maps};
use crate::plugin::gpu::grain::LIGHTER;
use bevy::{asset::Handle, image::Image, math::Affine2};
use bevy::{
    pbr::{ParallaxMappingMethod, StandardMaterialKey},
    prelude::{AlphaMode, Color, LinearRgba, Mesh3d, MeshMaterial3d, StandardMaterial, Vec2},
};
use core::hash::{Hash, Hasher};
use std::collections::hash_map::DefaultHasher;

impl CrackMaterial for StandardMaterial {
    const MAPS: Maps = Maps { diffuse: true, normal: true, depth: true, emissive: true, mips: true };

    fn pictures(&self) -> [Option<Handle<Image>>; 3] {
        [self.base_color_texture.clone(), self.normal_map_texture.clone(), self.depth_map.clone()]
    }

    fn show(&mut self, textures: &CrackTextures, relief: f32) {
        if let Some(diffuse) = &textures.diffuse {
            self.base_color_texture = Some(diffuse.clone());
        }
        if let Some(normal) = &textures.normal {
            self.normal_map_texture = Some(normal.clone());
        }
        if let Some(emissive) = textures.emissive.as_ref().filter(|_| self.emissive_texture.is_none()) {
            self.emissive_texture = Some(emissive.clone());
            self.emissive = LinearRgba::WHITE;
        }
        let Some(depth) = &textures.depth else { return };
        if self.depth_map.is_none() {
            // Half of what the normals say: seen from the side, deeper cracks swim.
            self.parallax_depth_scale = 0.5 * relief;
            self.parallax_mapping_method = ParallaxMappingMethod::Relief { max_steps: 5 };
            self.max_parallax_layer_count = 32.0;
        }
        self.depth_map = Some(depth.clone());
    }

    fn uv_transform(&self) -> Affine2 {
        self.uv_transform
    }

    fn show_upper_half(&mut self) {
        self.uv_transform = Affine2::from_scale(Vec2::new(1.0, 0.5)) * self.uv_transform;
        // Depth is in units of the texture, which is twice as high.
        self.parallax_depth_scale *= 0.5;
    }

    fn show_all(&mut self) {
        self.uv_transform = Affine2::IDENTITY;
    }

    fn open(&mut self) {
        if self.alpha_mode == AlphaMode::Opaque {
            self.alpha_mode = AlphaMode::Mask(0.5);
        }
    }

    fn close(&mut self, original: &Self) {
        self.alpha_mode = original.alpha_mode;
        (self.double_sided, self.cull_mode) = (original.double_sided, original.cull_mode);
    }

    fn show_inside(&mut self) {
        (self.double_sided, self.cull_mode) = (true, None);
    }

    /// Shards in 3D shrink instead of fading.
    fn for_shards(&mut self, picture: &Handle<Image>, _opacity: f32) {
        self.base_color_texture = Some(picture.clone());
        self.uv_transform = Affine2::IDENTITY;
    }

    fn for_sides(&self, look: &SideLook, grain: Option<Handle<Image>>) -> Option<Self> {
        let share = look.rim.bright.clamp(0.0, 1.0);
        let lighter = if grain.is_some() { LIGHTER } else { 1.0 };
        let fresh = [0, 1, 2].map(|i| FRESH[i] * lighter * look.mean[i]);
        let [red, green, blue] =
            [0, 1, 2].map(|i| fresh[i] * (1.0 - share) + (0.4 * look.mean[i] + 0.6 * EDGE[i]) * share);
        let color = Color::srgb(red, green, blue);
        Some(Self {
            base_color: color,
            // Light that has entered elsewhere leaves through the edges of glass.
            emissive: color.to_linear() * (GLOW * share),
            base_color_texture: grain,
            uv_transform: Affine2::from_scale(Vec2::splat(1.0 / (GRAIN * look.unit).max(f32::MIN_POSITIVE))),
            normal_map_texture: None,
            emissive_texture: None,
            depth_map: None,
            ..self.clone()
        })
    }

    fn pipeline_key(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        StandardMaterialKey::from(self).hash(&mut hasher);
        core::mem::discriminant(&self.alpha_mode).hash(&mut hasher);
        core::mem::discriminant(&self.opaque_render_method).hash(&mut hasher);
        hasher.finish()
    }
}

/// A wall where it is freshly broken, as a share of its picture's mean colour, sRGB: darker, and a little warmer.
const FRESH: [f32; 3] = [0.69, 0.68, 0.665];

/// How far the picture of the grain reaches, pattern units.
const GRAIN: f32 = 0.35;

/// The edge of a pane of glass, sRGB, and how much it glows.
const EDGE: [f32; 3] = [0.72, 0.94, 0.88];
const GLOW: f32 = 0.35;

impl MaterialSlot for MeshMaterial3d<StandardMaterial> {
    type Material = StandardMaterial;
    type Mesh = Mesh3d;

    fn material(&self) -> &Handle<StandardMaterial> {
        &self.0
    }

    fn set_material(&mut self, material: Handle<StandardMaterial>) {
        self.0 = material;
    }
}

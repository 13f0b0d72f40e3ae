//! `ColorMaterial` shows cracks.

use super::slot::{CrackMaterial, MaterialSlot, SideLook};
use crate::plugin::api::textures::{CrackTextures, Maps};
use bevy::{asset::Handle, image::Image, math::Affine2};
use bevy::{
    prelude::{Alpha, ColorMaterial, Mesh2d, MeshMaterial2d},
    sprite_render::AlphaMode2d,
};

impl CrackMaterial for ColorMaterial {
    const MAPS: Maps = Maps { diffuse: true, normal: true, depth: false, emissive: false, mips: true };

    fn pictures(&self) -> [Option<Handle<Image>>; 3] {
        [self.texture.clone(), None, None]
    }

    fn show(&mut self, textures: &CrackTextures, _relief: f32) {
        if let Some(diffuse) = &textures.diffuse {
            self.texture = Some(diffuse.clone());
        }
    }

    fn uv_transform(&self) -> Affine2 {
        self.uv_transform
    }

    fn open(&mut self) {
        if self.alpha_mode == AlphaMode2d::Opaque {
            self.alpha_mode = AlphaMode2d::Mask(0.5);
        }
    }

    fn close(&mut self, original: &Self) {
        self.alpha_mode = original.alpha_mode;
    }

    fn for_shards(&mut self, picture: &Handle<Image>, opacity: f32) {
        self.texture = Some(picture.clone());
        self.uv_transform = Affine2::IDENTITY;
        self.alpha_mode = AlphaMode2d::Blend;
        self.color = self.color.with_alpha(self.color.alpha() * opacity);
    }

    fn for_sides(&self, _look: &SideLook, _grain: Option<Handle<Image>>) -> Option<Self> {
        None
    }

    fn pipeline_key(&self) -> u64 {
        match self.alpha_mode {
            AlphaMode2d::Opaque => 0,
            AlphaMode2d::Mask(_) => 1,
            AlphaMode2d::Blend => 2,
        }
    }
}

impl MaterialSlot for MeshMaterial2d<ColorMaterial> {
    type Material = ColorMaterial;
    type Mesh = Mesh2d;

    fn material(&self) -> &Handle<ColorMaterial> {
        &self.0
    }

    fn set_material(&mut self, material: Handle<ColorMaterial>) {
        self.0 = material;
    }
}

//! [`Tint`]: colours that pictures are multiplied by.

use bevy::prelude::*;

/// A colour that pictures are multiplied by.
pub(super) struct Tint {
    /// Red, green, blue, alpha; sRGB.
    color: [f32; 4],
    /// What becomes of each byte of each channel; `None` = nothing else.
    table: Option<Box<[[u8; 256]; 4]>>,
}

impl Tint {
    pub(super) const NONE: Self = Self { color: [1.0; 4], table: None };

    /// Becomes that of another colour.
    pub(super) fn become_of(&mut self, color: [f32; 4]) {
        if self.color != color {
            *self = Self::new(color);
        }
    }

    fn new(color: [f32; 4]) -> Self {
        if color == Self::NONE.color {
            return Self::NONE;
        }
        let [red, green, blue, alpha] = color;
        let linear = LinearRgba::from(Srgba { red, green, blue, alpha }).to_f32_array();
        let mut table = Box::new([[0; 256]; 4]);
        for byte in 0..=255u8 {
            let texel = LinearRgba::from(Srgba::from_u8_array([byte; 4])).to_f32_array();
            let mut product = [0.0; 4];
            product.iter_mut().zip(texel).zip(linear).for_each(|((out, a), b)| *out = a * b);
            let bytes = Srgba::from(LinearRgba::from_f32_array(product)).to_u8_array();
            table.iter_mut().zip(bytes).for_each(|(channel, out)| channel[usize::from(byte)] = out);
        }
        Self { color, table: Some(table) }
    }

    pub(super) fn of(&self, texel: [u8; 4]) -> [u8; 4] {
        let Some(table) = &self.table else { return texel };
        let mut channels = table.iter();
        texel.map(|byte| channels.next().map_or(byte, |channel| channel[usize::from(byte)]))
    }
}

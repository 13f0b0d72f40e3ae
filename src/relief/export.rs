//! Contours and meshes as text: SVG, JSON and OBJ.

use super::{contours::Contours, mesh::ReliefMesh};
use glam::Vec2;
use std::fmt::Write;

impl Contours {
    /// The rings as an SVG picture of a surface of `extent` pattern units, `width` user units wide: lowest first, higher
    /// levels darker.
    ///
    /// ```
    /// use bevy_crack::relief::{Contours, Ring};
    ///
    /// let triangle = Ring { points: vec![[0.0, 0.0].into(), [1.0, 0.0].into(), [0.5, 1.0].into()], level: 0 };
    /// let contours = Contours { rings: vec![triangle], distance: 0.1 };
    /// assert!(contours.to_svg([1.0, 1.0].into(), 100.0).contains("M0 0L100 0L50 100Z"));
    /// assert!(contours.to_json().contains("[[0,0],[1,0],[0.5,1]]"));
    /// ```
    #[must_use]
    pub fn to_svg(&self, extent: Vec2, width: f32) -> String {
        let scale = width / extent.x;
        let (lowest, highest) = self.levels().unwrap_or((0, 0));
        let height = extent.y * scale;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" fill=\"none\" stroke-width=\"{}\">\n",
            width / 1000.0
        );
        for ring in &self.rings {
            let share = (ring.level - lowest) as f32 / (highest - lowest).max(1) as f32;
            let tone = (150.0 - 130.0 * share) as u8;
            // Writing to a string cannot fail.
            let _ = write!(svg, "<path stroke=\"rgb({tone},{},{})\" d=\"", tone / 2 + 30, tone / 4 + 10);
            for (i, point) in ring.points.iter().enumerate() {
                let at = (*point * scale * 100.0).round() / 100.0;
                let _ = write!(svg, "{}{} {}", if i == 0 { 'M' } else { 'L' }, at.x, at.y);
            }
            svg.push_str("Z\"/>\n");
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// The rings as a JSON text: `{"distance": d, "rings": [{"level": k, "points": [[x, y], ..]}, ..]}`.
    ///
    /// The numbers are those of the rings, to the last bit; one that is not finite becomes `null`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let number = |value: f32| if value.is_finite() { value.to_string() } else { "null".into() };
        let mut json = format!("{{\"distance\":{},\"rings\":[", number(self.distance));
        for (i, ring) in self.rings.iter().enumerate() {
            let points: Vec<_> = ring.points.iter().map(|p| format!("[{},{}]", number(p.x), number(p.y))).collect();
            let comma = if i == 0 { "" } else { "," };
            let _ = write!(json, "{comma}\n{{\"level\":{},\"points\":[{}]}}", ring.level, points.join(","));
        }
        json.push_str("\n]}\n");
        json
    }
}

impl ReliefMesh {
    /// The mesh as a Wavefront OBJ text, texture coordinates with v up.
    ///
    /// ```
    /// use bevy_crack::{Grid, relief::{ReliefFrame, ReliefMesh}};
    ///
    /// let mesh = ReliefMesh::new(&Grid::new([2, 2].into(), 0.0), &ReliefFrame::new([2.0, 2.0].into()), 0)?;
    /// assert!(mesh.to_obj().starts_with("v -1 1 0\n"));
    /// assert!(mesh.to_obj().ends_with("f 1/1/1 4/4/4 2/2/2\n"));
    /// # Ok::<(), bevy_crack::relief::ReliefError>(())
    /// ```
    #[must_use]
    pub fn to_obj(&self) -> String {
        let mut obj = String::with_capacity(self.positions.len() * 100);
        for [x, y, z] in &self.positions {
            let _ = writeln!(obj, "v {x} {y} {z}");
        }
        for [u, v] in &self.uvs {
            let _ = writeln!(obj, "vt {u} {}", 1.0 - v);
        }
        for [x, y, z] in &self.normals {
            let _ = writeln!(obj, "vn {x} {y} {z}");
        }
        for [a, b, c] in self.indices.as_chunks().0 {
            let _ = writeln!(obj, "f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}", a + 1, b + 1, c + 1);
        }
        obj
    }
}

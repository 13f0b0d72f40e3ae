//! The end of a growth, drawn into an untouched field.

use super::tile_set::Touched;
use crate::growth::CrackGrowth;
use crate::pattern::Moment;
use crate::raster::{DOT_DEPTH, DepthField, Profile, stamp_dot, stamp_path};

/// Stamps the end of a growth into an untouched field.
pub(crate) fn stamp_all(growth: &CrackGrowth, profile: &Profile, field: &mut DepthField, touched: &mut Touched) {
    let (network, timeline) = (growth.network(), growth.timeline());
    let end = Moment::after(timeline.end());
    for dot in (0..).map_while(|dot| timeline.dot_at(dot, end)) {
        stamp_dot(field, dot.pos, dot.radius, DOT_DEPTH);
    }
    for segment in network.segments() {
        if let Some(path) = network.path(segment) {
            touched.mark(stamp_path(field, profile, &path));
        }
    }
    field.show_layers(network, timeline, end, &mut Vec::new());
}

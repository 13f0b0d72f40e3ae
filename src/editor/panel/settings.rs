//! [`Panel`]: what the panel remembers.

use crate::editor::subject::AnalogyChoice;
use crate::plugin::{CrackGuide, CrackRelief, CrackStrands, GuidedCracks};

/// What the panel remembers: tools, overlays and drafts. The settings of surfaces are in their components alone.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Energy of a hit by a click, 0..=16; default 1.
    pub energy: f32,
    /// Whether a click on a surface hits it; it is chosen in any case. Default true.
    pub hits_on_click: bool,
    /// Whether a click hits all surfaces at the same texture coordinates: with other presets and one seed they can be compared.
    /// Default false.
    pub hits_all: bool,
    /// What is drawn over the chosen surface.
    pub overlays: Overlays,
    /// Folder that files are written to.
    pub folder: String,
    /// Name of the file that the preset is written to.
    pub file: String,
    /// Guided cracks that are not baked yet.
    pub guided: GuidedCracks,
    /// What they draw, if they draw a text.
    pub text: String,
    /// Strands that are not baked yet.
    pub strands: CrackStrands,
    /// The relief that is to be made.
    pub relief: CrackRelief,
    /// The photographs that cracks are to be like.
    pub analogy: AnalogyChoice,
    /// What went wrong or well last.
    pub message: String,
    /// Whether there is something to undo, and to redo.
    pub can_undo: (bool, bool),
}

/// What is drawn over the chosen surface; nothing by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlays {
    /// The network; colours are ages.
    pub network: bool,
    /// Ends that grow.
    pub tips: bool,
    /// Markers that attract cracks.
    pub markers: bool,
    /// Around each hit its reach, and the distance at which markers are removed.
    pub radii: bool,
    /// Closed cells.
    pub cells: bool,
    /// Rectangles that were painted again lately.
    pub dirty: bool,
}

impl Default for Panel {
    fn default() -> Self {
        Self {
            energy: 1.0,
            hits_on_click: true,
            hits_all: false,
            overlays: Overlays::default(),
            folder: "cracks".into(),
            file: "mine.crack.ron".into(),
            guided: GuidedCracks::new(CrackGuide::text("CRACK")),
            text: "CRACK".into(),
            strands: CrackStrands::default(),
            relief: CrackRelief::default(),
            analogy: AnalogyChoice { file: "analogies/clay.analogy.ron".into(), keeps_picture: true, seed: 0 },
            message: String::new(),
            can_undo: (false, false),
        }
    }
}

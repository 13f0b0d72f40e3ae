//! The page that the app runs in, if it does.

/// Whether there is one.
pub(crate) const IS_BROWSER: bool = cfg!(target_family = "wasm");

/// The size of the page, CSS pixels.
#[cfg(target_family = "wasm")]
pub(crate) fn size() -> Option<bevy::math::UVec2> {
    let window = web_sys::window()?;
    let length = |value: Result<wasm_bindgen::JsValue, _>| value.ok()?.as_f64().map(|length| length as u32);
    Some(bevy::math::UVec2::new(length(window.inner_width())?, length(window.inner_height())?))
}

#[cfg(not(target_family = "wasm"))]
pub(crate) const fn size() -> Option<bevy::math::UVec2> {
    None
}

/// Writes a number into an attribute `data-…` of the page's root: the page hides its loading line by it, and tests read it.
#[cfg(target_family = "wasm")]
pub(crate) fn tell(name: &str, value: u32) {
    let root = web_sys::window().and_then(|window| window.document()).and_then(|document| document.document_element());
    if let Some(root) = root {
        // It fails for names that are none.
        let _ = root.set_attribute(&format!("data-{name}"), &value.to_string());
    }
}

#[cfg(not(target_family = "wasm"))]
pub(crate) const fn tell(_name: &str, _value: u32) {}

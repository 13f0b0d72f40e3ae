//! A form for any reflected value: a slider for each number, with its range, unit and tooltip from the documentation of the field.

use super::text;
use bevy::reflect::{
    NamedField, PartialReflect, ReflectMut, ReflectRef, TypeInfo,
    enums::{DynamicEnum, DynamicVariant, Enum, EnumInfo, VariantInfo, VariantType},
    list::List,
    structs::DynamicStruct,
    tuple::DynamicTuple,
};
use bevy_egui::egui::{self, Response, Ui};

/// Width of the names, points.
const NAMES: f32 = 118.0;

/// Values of the same type as the one that is edited. The first is what a field goes back to; switched on, a part starts as the first
/// of them has it.
pub(super) type Examples<'a> = Vec<&'a dyn PartialReflect>;

/// What is known of a field beside its value.
#[derive(Clone, Copy)]
struct Field<'a> {
    name: &'a str,
    docs: &'a str,
}

/// A form for all fields of a struct. Returns whether one of them was changed.
pub(super) fn show_fields(ui: &mut Ui, value: &mut dyn PartialReflect, examples: &Examples) -> bool {
    let Some(TypeInfo::Struct(info)) = value.get_represented_type_info() else { return false };
    let ReflectMut::Struct(value) = value.reflect_mut() else { return false };
    let mut changed = false;
    for i in 0..info.field_len() {
        let (Some(field), Some(value)) = (info.field_at(i), value.field_at_mut(i)) else { continue };
        let examples = inside(examples, |example| match example.reflect_ref() {
            ReflectRef::Struct(example) => example.field_at(i),
            _ => None,
        });
        changed |= show_field(ui, of(field), value, &examples);
    }
    changed
}

/// The same for some of the fields.
pub(super) fn show_some(
    ui: &mut Ui,
    value: &mut dyn PartialReflect,
    example: &dyn PartialReflect,
    names: &[&str],
) -> bool {
    let Some(TypeInfo::Struct(info)) = value.get_represented_type_info() else { return false };
    let (ReflectMut::Struct(value), ReflectRef::Struct(example)) = (value.reflect_mut(), example.reflect_ref()) else {
        return false;
    };
    names.iter().fold(false, |changed, name| {
        let (Some(field), Some(value)) = (info.field(name), value.field_mut(name)) else { return changed };
        show_field(ui, of(field), value, &example.field(name).into_iter().collect()) || changed
    })
}

fn of(field: &NamedField) -> Field<'_> {
    Field { name: field.name(), docs: field.docs().unwrap_or_default() }
}

/// A part of each example that has it.
fn inside<'a>(
    examples: &Examples<'a>,
    part: impl Fn(&'a dyn PartialReflect) -> Option<&'a dyn PartialReflect>,
) -> Examples<'a> {
    examples.iter().filter_map(|example| part(*example)).collect()
}

/// A field of any type: a row, or rows under its name.
fn show_field(ui: &mut Ui, field: Field, value: &mut dyn PartialReflect, examples: &Examples) -> bool {
    ui.push_id(field.name, |ui| {
        let is_row = is_leaf(value);
        if is_row {
            return row(ui, field, value, examples);
        }
        match value.reflect_mut() {
            ReflectMut::Enum(value) => show_enum(ui, field, value, examples),
            ReflectMut::List(value) => show_list(ui, field, value, examples),
            ReflectMut::Struct(_) => under(ui, field, |ui| show_fields(ui, value, examples)),
            _ => {
                named(ui, field, |ui, _| ui.weak("—").on_hover_text("This has no editor here."));
                false
            }
        }
    })
    .inner
}

/// Rows under the name of a field.
fn under<T: Default>(ui: &mut Ui, field: Field, rows: impl FnOnce(&mut Ui) -> T) -> T {
    let header = egui::CollapsingHeader::new(text::words(field.name)).id_salt(field.name).show(ui, rows);
    hint(header.header_response, field);
    header.body_returned.unwrap_or_default()
}

fn hint(response: Response, field: Field) -> Response {
    if field.docs.is_empty() { response } else { response.on_hover_text(text::plain(field.docs)) }
}

/// A row with the name of a field, which labels its widget for screen readers and tests.
fn named<T>(ui: &mut Ui, field: Field, widget: impl FnOnce(&mut Ui, egui::Id) -> T) -> T {
    ui.horizontal(|ui| {
        let name = egui::Label::new(text::words(field.name)).truncate();
        let response = ui
            .allocate_ui_with_layout(
                egui::vec2(NAMES, ui.spacing().interact_size.y),
                egui::Layout::left_to_right(egui::Align::Center),
                |ui| {
                    ui.set_min_width(NAMES);
                    ui.add(name)
                },
            )
            .inner;
        let label = response.id;
        hint(response, field);
        widget(ui, label)
    })
    .inner
}

fn is_leaf(value: &dyn PartialReflect) -> bool {
    value.try_downcast_ref::<glam::Vec2>().is_some()
        || value.try_downcast_ref::<[f32; 3]>().is_some()
        || value.try_downcast_ref::<bool>().is_some()
        || value.try_downcast_ref::<String>().is_some()
        || number(value).is_some()
}

/// One row, with a button that goes back to the example if the value is another one.
fn row(ui: &mut Ui, field: Field, value: &mut dyn PartialReflect, examples: &Examples) -> bool {
    named(ui, field, |ui, label| {
        let mut changed = widget(ui, field, value, label);
        if let Some(example) = examples.first()
            && value.reflect_partial_eq(*example) == Some(false)
        {
            let back = ui.small_button("⟲").on_hover_text(format!("Back to {}", brief(*example)));
            if back.clicked() {
                changed |= value.try_apply(*example).is_ok();
            }
        }
        changed
    })
}

fn brief(value: &dyn PartialReflect) -> String {
    number(value).map_or_else(|| format!("{value:?}"), |number| format!("{number}"))
}

fn widget(ui: &mut Ui, field: Field, value: &mut dyn PartialReflect, label: egui::Id) -> bool {
    if let Some(value) = value.try_downcast_mut::<bool>() {
        return ui.checkbox(value, "").labelled_by(label).changed();
    }
    if let Some(value) = value.try_downcast_mut::<String>() {
        return ui.text_edit_singleline(value).labelled_by(label).changed();
    }
    if let Some(value) = value.try_downcast_mut::<[f32; 3]>() {
        return show_color(ui, value, label);
    }
    if let Some(value) = value.try_downcast_mut::<glam::Vec2>() {
        let range = text::range(field.docs).map_or(f32::MIN..=f32::MAX, |r| *r.start() as f32..=*r.end() as f32);
        return [&mut value.x, &mut value.y].into_iter().fold(false, |changed, value| {
            let drag = egui::DragValue::new(value).speed(0.01).range(range.clone());
            ui.add(drag).labelled_by(label).changed() || changed
        });
    }
    let Some(mut to) = number(value) else { return false };
    let is_whole = value.try_downcast_ref::<f32>().is_none() && value.try_downcast_ref::<f64>().is_none();
    let response = show_number(ui, &mut to, is_whole, field.docs).labelled_by(label);
    response.changed() && set_number(value, to)
}

/// A slider where there is a range, logarithmic if it spans orders of magnitude.
fn show_number(ui: &mut Ui, value: &mut f64, is_whole: bool, docs: &str) -> Response {
    let Some(range) = text::range(docs) else {
        let drag = egui::DragValue::new(value).speed(if is_whole { 0.2 } else { 0.01 });
        let drag = if is_whole { drag.range(0.0..=f64::from(u32::MAX)).fixed_decimals(0) } else { drag };
        return ui.add(drag.suffix(text::unit(docs)));
    };
    let (min, max) = (*range.start(), *range.end());
    let is_wide = if min > 0.0 { max / min > 60.0 } else { min == 0.0 && max > 12.0 };
    let slider = egui::Slider::new(value, range).suffix(text::unit(docs)).logarithmic(is_wide && min >= 0.0);
    let slider = slider.smallest_positive((max * 1e-5).max(1e-4)).clamping(egui::SliderClamping::Always);
    ui.spacing_mut().slider_width = (ui.available_width() - 92.0).clamp(40.0, 220.0);
    ui.add(if is_whole { slider.integer() } else { slider.max_decimals(4) })
}

fn show_color(ui: &mut Ui, value: &mut [f32; 3], label: egui::Id) -> bool {
    let mut bytes = value.map(|part| (part * 255.0).round() as u8);
    let changed = ui.color_edit_button_srgb(&mut bytes).labelled_by(label).changed();
    if changed {
        *value = bytes.map(|part| f32::from(part) / 255.0);
    }
    changed
}

macro_rules! numbers {
    ($($kind:ty),*) => {
        /// A number of any type.
        fn number(value: &dyn PartialReflect) -> Option<f64> {
            $(if let Some(value) = value.try_downcast_ref::<$kind>() {
                return Some(*value as f64);
            })*
            None
        }

        fn set_number(value: &mut dyn PartialReflect, to: f64) -> bool {
            $(if let Some(value) = value.try_downcast_mut::<$kind>() {
                *value = to as $kind;
                return true;
            })*
            false
        }

        /// The number that a part of this type starts with: a value within the range that its documentation names.
        fn fresh_number(info: &TypeInfo, docs: &str) -> Option<Box<dyn PartialReflect>> {
            let start = text::range(docs).map_or(1.0, |range| match *range.start() {
                least if least > 0.0 => (least * range.end()).sqrt(),
                least => 0.25f64.mul_add(range.end() - least, least),
            });
            $(if info.is::<$kind>() {
                return Some(Box::new(start as $kind));
            })*
            None
        }
    };
}

numbers!(f32, f64, u32, u64, i32, usize, u8, u16);

/// A choice; an option is a box to tick.
fn show_enum(ui: &mut Ui, field: Field, value: &mut dyn Enum, examples: &Examples) -> bool {
    let Some(TypeInfo::Enum(info)) = value.get_represented_type_info() else { return false };
    let names = info.variant_names();
    let changed = if names == ["None", "Some"] {
        tick(ui, field, value, info, examples)
    } else {
        choose(ui, field, value, info, examples)
    };
    let variant = value.variant_name().to_owned();
    if value.field_len() == 0 {
        return changed;
    }
    ui.indent(field.name, |ui| show_variant(ui, value, info, &variant, examples)).inner || changed
}

fn tick(ui: &mut Ui, field: Field, value: &mut dyn Enum, info: &EnumInfo, examples: &Examples) -> bool {
    let mut is_on = value.variant_name() == "Some";
    let can_start = is_on || start(value, info, "Some", examples).is_some();
    let response = named(ui, field, |ui, label| {
        ui.add_enabled(can_start, egui::Checkbox::without_text(&mut is_on)).labelled_by(label)
    });
    let name = if is_on { "Some" } else { "None" };
    response.changed() && switch(value, info, name, examples)
}

fn choose(ui: &mut Ui, field: Field, value: &mut dyn Enum, info: &EnumInfo, examples: &Examples) -> bool {
    named(ui, field, |ui, label| {
        let mut chosen = None;
        let now = value.variant_name().to_owned();
        let choice = egui::ComboBox::from_id_salt(field.name).selected_text(text::words(&now)).show_ui(ui, |ui| {
            for name in info.variant_names() {
                let can_start = *name == now || start(value, info, name, examples).is_some();
                let label = ui.add_enabled(can_start, egui::Button::selectable(*name == now, text::words(name)));
                let docs = info.variant(name).and_then(VariantInfo::docs).unwrap_or_default();
                if hint(label, Field { name, docs }).clicked() && *name != now {
                    chosen = Some(*name);
                }
            }
        });
        choice.response.labelled_by(label);
        chosen.is_some_and(|name| switch(value, info, name, examples))
    })
}

fn switch(value: &mut dyn Enum, info: &EnumInfo, name: &str, examples: &Examples) -> bool {
    let Some(start) = start(value, info, name, examples) else { return false };
    value.try_apply(&*start).is_ok()
}

/// The value that a variant starts with: that of an example, else one within the ranges of its fields.
fn start(value: &dyn Enum, info: &EnumInfo, name: &str, examples: &Examples) -> Option<Box<dyn PartialReflect>> {
    let example = examples.iter().find(|example| match example.reflect_ref() {
        ReflectRef::Enum(example) => example.variant_name() == name && example.type_id_of() == value.type_id_of(),
        _ => false,
    });
    match example {
        Some(example) => Some(example.to_dynamic()),
        None => fresh_variant(info, name).map(|fresh| -> Box<dyn PartialReflect> { Box::new(fresh) }),
    }
}

/// The type behind a reflected value.
trait TypeIdOf {
    fn type_id_of(&self) -> Option<core::any::TypeId>;
}

impl<T: PartialReflect + ?Sized> TypeIdOf for T {
    fn type_id_of(&self) -> Option<core::any::TypeId> {
        self.get_represented_type_info().map(TypeInfo::type_id)
    }
}

fn fresh_variant(info: &EnumInfo, name: &str) -> Option<DynamicEnum> {
    let fields: DynamicVariant = match info.variant(name)? {
        VariantInfo::Unit(_) => DynamicVariant::Unit,
        VariantInfo::Tuple(variant) => {
            let mut tuple = DynamicTuple::default();
            for field in variant.iter() {
                tuple.insert_boxed(fresh(field.type_info()?, field.docs().unwrap_or_default())?);
            }
            tuple.into()
        }
        VariantInfo::Struct(variant) => {
            let mut fields = DynamicStruct::default();
            for field in variant.iter() {
                fields.insert_boxed(field.name(), fresh(field.type_info()?, field.docs().unwrap_or_default())?);
            }
            fields.into()
        }
    };
    Some(DynamicEnum::new(name, fields))
}

/// A value of a type that no example has; `None` where none can be made up.
fn fresh(info: &TypeInfo, docs: &str) -> Option<Box<dyn PartialReflect>> {
    if let Some(number) = fresh_number(info, docs) {
        return Some(number);
    }
    if info.is::<bool>() {
        return Some(Box::new(false));
    }
    if info.is::<String>() {
        return Some(Box::new(String::new()));
    }
    if info.is::<glam::Vec2>() {
        return Some(Box::new(glam::Vec2::splat(0.5)));
    }
    match info {
        TypeInfo::Enum(info) => {
            let variants = info.variant_names().iter();
            variants
                .copied()
                .find_map(|name| fresh_variant(info, name))
                .map(|fresh| -> Box<dyn PartialReflect> { Box::new(fresh) })
        }
        TypeInfo::Struct(info) => {
            let mut fields = DynamicStruct::default();
            for field in info.iter() {
                fields.insert_boxed(field.name(), fresh(field.type_info()?, field.docs().unwrap_or_default())?);
            }
            Some(Box::new(fields))
        }
        _ => None,
    }
}

fn show_variant(ui: &mut Ui, value: &mut dyn Enum, info: &EnumInfo, variant: &str, examples: &Examples) -> bool {
    let mut changed = false;
    for i in 0..value.field_len() {
        let examples = inside(examples, |example| match example.reflect_ref() {
            ReflectRef::Enum(example) if example.variant_name() == variant => example.field_at(i),
            _ => None,
        });
        let (name, docs) = match info.variant(variant) {
            Some(VariantInfo::Struct(variant)) => {
                variant.field_at(i).map_or(("", ""), |field| (field.name(), field.docs().unwrap_or_default()))
            }
            Some(VariantInfo::Tuple(variant)) => {
                ("", variant.field_at(i).and_then(|field| field.docs()).unwrap_or_default())
            }
            _ => ("", ""),
        };
        let is_tuple = value.variant_type() == VariantType::Tuple;
        let Some(part) = value.field_at_mut(i) else { continue };
        // What an option or a tuple holds has no name of its own.
        changed |= match part.reflect_ref() {
            ReflectRef::Struct(_) if is_tuple && !is_leaf(part) => show_fields(ui, part, &examples),
            _ => show_field(ui, Field { name: if name.is_empty() { "value" } else { name }, docs }, part, &examples),
        };
    }
    changed
}

/// A list whose items can be removed, and the last one doubled.
fn show_list(ui: &mut Ui, field: Field, list: &mut dyn List, examples: &Examples) -> bool {
    let title = format!("{} ({})", text::words(field.name), list.len());
    let header = egui::CollapsingHeader::new(title).id_salt(field.name).show(ui, |ui| {
        let (mut changed, mut gone) = (false, None);
        for i in 0..list.len() {
            let Some(item) = list.get_mut(i) else { continue };
            let examples = inside(examples, |example| match example.reflect_ref() {
                ReflectRef::List(example) => example.get(i),
                _ => None,
            });
            ui.push_id(i, |ui| {
                ui.horizontal(|ui| {
                    ui.weak(format!("{}", i + 1));
                    if ui.small_button("−").on_hover_text("Remove this one").clicked() {
                        gone = Some(i);
                    }
                });
                ui.indent(i, |ui| {
                    changed |= if is_leaf(item) {
                        row(ui, Field { name: "value", docs: field.docs }, item, &examples)
                    } else {
                        show_fields(ui, item, &examples)
                    };
                });
            });
        }
        if let Some(i) = gone {
            list.remove(i);
        }
        let more = list.len().checked_sub(1).and_then(|last| list.get(last)).map(PartialReflect::to_dynamic);
        let more = more.or_else(|| first_item(examples));
        if let Some(more) = more
            && ui.small_button("+").on_hover_text("One more").clicked()
        {
            list.push(more);
            changed = true;
        }
        changed || gone.is_some()
    });
    hint(header.header_response, field);
    header.body_returned.unwrap_or_default()
}

/// The first item that an example has.
fn first_item(examples: &Examples) -> Option<Box<dyn PartialReflect>> {
    examples.iter().find_map(|example| match example.reflect_ref() {
        ReflectRef::List(example) => example.get(0).map(PartialReflect::to_dynamic),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::growth::{GrowthParams, MarkerLayout, StartLayout};
    use crate::{CrackPreset, paint::Look};
    use bevy::reflect::Typed;

    /// Every number of a preset has a range, and what a slider can reach is what the preset's check lets through.
    #[test]
    fn sliders_reach_what_is_valid() {
        let TypeInfo::Struct(info) = GrowthParams::type_info() else { panic!("a struct") };
        let mut n_numbers = 0;
        for field in info.iter() {
            let Some(info) = field.type_info() else { continue };
            if fresh_number(info, "").is_none() {
                continue;
            }
            let range = text::range(field.docs().unwrap()).unwrap_or_else(|| panic!("{} has no range", field.name()));
            for (end, beyond) in [(*range.start(), -1.0), (*range.end(), 1.0)] {
                let mut preset = CrackPreset::CONCRETE;
                let ReflectMut::Struct(growth) = preset.growth.reflect_mut() else { panic!("a struct") };
                set_number(growth.field_mut(field.name()).unwrap(), end);
                // Another field may narrow it further; its range is not this one then.
                let complaint = preset.validate().err().map(|error| error.to_string()).unwrap_or_default();
                let own = format!("must lie in {}..={}", range.start(), range.end());
                assert!(!complaint.ends_with(&own), "{complaint}");
                let ReflectMut::Struct(growth) = preset.growth.reflect_mut() else { panic!("a struct") };
                set_number(growth.field_mut(field.name()).unwrap(), end + beyond * 1.5 * end.abs().max(1.0));
                let clipped = number(growth.field(field.name()).unwrap()).unwrap();
                assert!(preset.validate().is_err() || range.contains(&clipped), "{} = {clipped}", field.name());
            }
            n_numbers += 1;
        }
        assert!(n_numbers > 30, "{n_numbers}");
    }

    #[test]
    fn parts_start_as_in_an_example_and_else_within_their_ranges() {
        let TypeInfo::Enum(info) = MarkerLayout::type_info() else { panic!("an enum") };
        for name in info.variant_names() {
            for examples in [vec![], vec![&CrackPreset::GLASS.growth.markers as &dyn PartialReflect]] {
                let mut preset = CrackPreset::CONCRETE;
                assert!(switch(&mut preset.growth.markers, info, name, &examples), "{name}");
                assert_eq!(Enum::variant_name(&preset.growth.markers), *name);
                assert_eq!(preset.validate(), Ok(()), "{name}");
                if *name == "Rays" && !examples.is_empty() {
                    assert_eq!(preset.growth.markers, CrackPreset::GLASS.growth.markers);
                }
            }
        }
        let TypeInfo::Enum(info) = StartLayout::type_info() else { panic!("an enum") };
        for name in info.variant_names() {
            let mut preset = CrackPreset::CONCRETE;
            assert!(switch(&mut preset.growth.starts, info, name, &vec![]), "{name}");
            assert_eq!(preset.validate(), Ok(()), "{name}");
        }
        let mut look = Look::GROOVE;
        let Some(TypeInfo::Enum(info)) = look.facets.get_represented_type_info() else { panic!("an enum") };
        let glass = Look::FROSTED;
        let examples: Examples = vec![&Look::GROOVE.facets, &glass.facets];
        assert!(switch(&mut look.facets, info, "Some", &examples) == glass.facets.is_some());
        assert_eq!(look.facets, glass.facets);
        assert!(switch(&mut look.facets, info, "None", &examples));
        assert_eq!(look.facets, None);
    }
}

//! Values with handles as the plain reflect serializer writes them.
//!
//! It cannot write handles, only [`HandleSerializeProcessor`] can, as the paths of their assets. What is here writes them so in any case, and
//! all else as the serializer does: [`HandleDeserializeProcessor`](bevy::asset::HandleDeserializeProcessor) reads it.

use crate::Grid;
use bevy::{
    asset::{EphemeralHandleBehavior, HandleSerializeProcessor},
    reflect::{
        PartialReflect, ReflectRef, TypeInfo, TypeRegistry,
        enums::{VariantInfo, VariantType},
        serde::{ReflectSerializerProcessor, TypedReflectSerializer},
    },
};
use serde::{
    Serialize, Serializer,
    ser::{Error, SerializeStruct, SerializeStructVariant},
};
use std::sync::Arc;

/// Writes handles, and what is shared.
struct Written;

impl ReflectSerializerProcessor for Written {
    fn try_serialize<S: Serializer>(
        &self,
        value: &dyn PartialReflect,
        registry: &TypeRegistry,
        serializer: S,
    ) -> Result<Result<S::Ok, S>, S::Error> {
        let known = value.try_as_reflect().map(|value| value.as_any());
        if let Some(grid) = known.and_then(|value| value.downcast_ref::<Arc<Grid<f32>>>()) {
            return grid.serialize(serializer).map(Ok);
        }
        if let Some(bytes) = known.and_then(|value| value.downcast_ref::<Arc<[u8]>>()) {
            return serializer.collect_seq(bytes.iter()).map(Ok);
        }
        // An asset without a path is said once in the log, and left out.
        let handles = HandleSerializeProcessor { ephemeral_handle_behavior: EphemeralHandleBehavior::Warn };
        handles.try_serialize(value, registry, serializer)
    }
}

/// Writes a struct or an enum of the crate.
pub(crate) fn write<S: Serializer>(
    value: &dyn PartialReflect,
    serializer: S,
    registry: &TypeRegistry,
) -> Result<S::Ok, S::Error> {
    let unknown = || S::Error::custom(format_args!("`{}` cannot be written", value.reflect_type_path()));
    let field = |field| TypedReflectSerializer::with_processor(field, registry, &Written);
    let info = value.get_represented_type_info().ok_or_else(unknown)?;
    let name = info.type_path_table().ident().ok_or_else(unknown)?;
    match (value.reflect_ref(), info) {
        (ReflectRef::Struct(value), TypeInfo::Struct(info)) => {
            let mut fields = serializer.serialize_struct(name, value.field_len())?;
            for (info, (_, value)) in info.iter().zip(value.iter_fields()) {
                fields.serialize_field(info.name(), &field(value))?;
            }
            fields.end()
        }
        (ReflectRef::Enum(value), TypeInfo::Enum(info)) => {
            let index = value.variant_index();
            let info = info.variant_at(index).ok_or_else(unknown)?;
            let (index, variant) = (index as u32, info.name());
            match (value.variant_type(), info) {
                (VariantType::Unit, _) => serializer.serialize_unit_variant(name, index, variant),
                (VariantType::Tuple, _) => {
                    let only = value.field_at(0).filter(|_| value.field_len() == 1).ok_or_else(unknown)?;
                    serializer.serialize_newtype_variant(name, index, variant, &field(only))
                }
                (VariantType::Struct, VariantInfo::Struct(info)) => {
                    let mut fields = serializer.serialize_struct_variant(name, index, variant, value.field_len())?;
                    for (info, value) in info.iter().zip(value.iter_fields()) {
                        fields.serialize_field(info.name(), &field(value.value()))?;
                    }
                    fields.end()
                }
                (VariantType::Struct, _) => Err(unknown()),
            }
        }
        _ => Err(unknown()),
    }
}

/// Has values of a type written by [`write`].
macro_rules! written {
    ($($type:ty),+) => {
        $(
            impl bevy::reflect::serde::SerializeWithRegistry for $type {
                fn serialize<S: serde::Serializer>(
                    &self,
                    serializer: S,
                    registry: &bevy::reflect::TypeRegistry,
                ) -> Result<S::Ok, S::Error> {
                    $crate::plugin::api::reflect::write(self, serializer, registry)
                }
            }
        )+
    };
}

written!(
    super::CrackAnalogy,
    super::CrackSurface,
    super::CrackStrands,
    super::PresetSource,
    super::CrackMaskSource,
    super::GuideSource,
    super::ShatterCracks,
    super::StrandField
);

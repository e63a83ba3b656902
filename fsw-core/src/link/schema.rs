//! One number that stands for the shape of every packet: peers with different shapes refuse each other.
//!
//! FNV-1a over a walk through the schemas of both directions, at compile time. Unlike the hash that comes with
//! postcard-schema it includes the names of types and the number of children, so that no rearrangement of equal
//! pieces can give the same walk.

use postcard_schema::Schema;
use postcard_schema::schema::{DataModelType, DataModelVariant, NamedType, NamedValue, NamedVariant};

use super::packet::{Downlink, Frame, Uplink};

/// Hash over the shapes of all packet types, both directions.
pub const SCHEMA_HASH: u64 =
    hash_type(hash_type(OFFSET_BASIS, <Frame<Uplink> as Schema>::SCHEMA), <Frame<Downlink> as Schema>::SCHEMA);

/// FNV-1a, 64 bit: start value and multiplier.
const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// Hash of the shape of one type.
#[must_use]
pub const fn schema_hash<T: Schema + ?Sized>() -> u64 {
    hash_type(OFFSET_BASIS, T::SCHEMA)
}

const fn hash_byte(state: u64, byte: u8) -> u64 {
    (state ^ byte as u64).wrapping_mul(PRIME)
}

/// A count in two bytes; schemas have far fewer children than 65,536.
const fn hash_count(state: u64, count: usize) -> u64 {
    hash_byte(hash_byte(state, count as u8), (count >> 8) as u8)
}

const fn hash_name(state: u64, name: &str) -> u64 {
    let mut rest = name.as_bytes();
    let mut state = hash_count(state, rest.len());
    while let [first, tail @ ..] = rest {
        state = hash_byte(state, *first);
        rest = tail;
    }
    state
}

const fn hash_type(state: u64, named: &NamedType) -> u64 {
    let state = hash_name(state, named.name);
    match named.ty {
        DataModelType::Bool => hash_byte(state, 1),
        DataModelType::I8 => hash_byte(state, 2),
        DataModelType::U8 => hash_byte(state, 3),
        DataModelType::I16 => hash_byte(state, 4),
        DataModelType::I32 => hash_byte(state, 5),
        DataModelType::I64 => hash_byte(state, 6),
        DataModelType::I128 => hash_byte(state, 7),
        DataModelType::U16 => hash_byte(state, 8),
        DataModelType::U32 => hash_byte(state, 9),
        DataModelType::U64 => hash_byte(state, 10),
        DataModelType::U128 => hash_byte(state, 11),
        DataModelType::Usize => hash_byte(state, 12),
        DataModelType::Isize => hash_byte(state, 13),
        DataModelType::F32 => hash_byte(state, 14),
        DataModelType::F64 => hash_byte(state, 15),
        DataModelType::Char => hash_byte(state, 16),
        DataModelType::String => hash_byte(state, 17),
        DataModelType::ByteArray => hash_byte(state, 18),
        DataModelType::Unit => hash_byte(state, 19),
        DataModelType::UnitStruct => hash_byte(state, 20),
        DataModelType::Schema => hash_byte(state, 21),
        DataModelType::Option(inner) => hash_type(hash_byte(state, 22), inner),
        DataModelType::NewtypeStruct(inner) => hash_type(hash_byte(state, 23), inner),
        DataModelType::Seq(inner) => hash_type(hash_byte(state, 24), inner),
        DataModelType::Map { key, val } => hash_type(hash_type(hash_byte(state, 25), key), val),
        DataModelType::Tuple(items) => hash_types(hash_byte(state, 26), items),
        DataModelType::TupleStruct(items) => hash_types(hash_byte(state, 27), items),
        DataModelType::Struct(fields) => hash_fields(hash_byte(state, 28), fields),
        DataModelType::Enum(variants) => hash_variants(hash_byte(state, 29), variants),
    }
}

const fn hash_types(state: u64, mut items: &[&NamedType]) -> u64 {
    let mut state = hash_count(state, items.len());
    while let [first, tail @ ..] = items {
        state = hash_type(state, first);
        items = tail;
    }
    state
}

const fn hash_fields(state: u64, mut fields: &[&NamedValue]) -> u64 {
    let mut state = hash_count(state, fields.len());
    while let [first, tail @ ..] = fields {
        state = hash_type(hash_name(state, first.name), first.ty);
        fields = tail;
    }
    state
}

const fn hash_variants(state: u64, mut variants: &[&NamedVariant]) -> u64 {
    let mut state = hash_count(state, variants.len());
    while let [first, tail @ ..] = variants {
        let named = hash_name(state, first.name);
        state = match first.ty {
            DataModelVariant::UnitVariant => hash_byte(named, 1),
            DataModelVariant::NewtypeVariant(inner) => hash_type(hash_byte(named, 2), inner),
            DataModelVariant::TupleVariant(items) => hash_types(hash_byte(named, 3), items),
            DataModelVariant::StructVariant(fields) => hash_fields(hash_byte(named, 4), fields),
        };
        variants = tail;
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shapes of one type `Sample` in one packet `Carrier`, as they would be before and after an edit.
    macro_rules! shape {
        ($module:ident, $($body:tt)*) => {
            mod $module {
                use postcard_schema::Schema;
                #[allow(dead_code)]
                #[derive(Schema)]
                $($body)*
                #[allow(dead_code)]
                #[derive(Schema)]
                pub enum Carrier { Other, Sample(Sample) }
            }
        };
    }
    shape!(
        original,
        pub struct Sample {
            pub range_m: f64,
            pub source: u8,
            pub kind: Option<u16>,
        }
    );
    shape!(
        renamed_field,
        pub struct Sample {
            pub distance_m: f64,
            pub source: u8,
            pub kind: Option<u16>,
        }
    );
    shape!(
        other_type,
        pub struct Sample {
            pub range_m: f32,
            pub source: u8,
            pub kind: Option<u16>,
        }
    );
    shape!(
        other_inner_type,
        pub struct Sample {
            pub range_m: f64,
            pub source: u8,
            pub kind: Option<u32>,
        }
    );
    shape!(
        other_order,
        pub struct Sample {
            pub source: u8,
            pub range_m: f64,
            pub kind: Option<u16>,
        }
    );
    shape!(
        added_field,
        pub struct Sample {
            pub range_m: f64,
            pub source: u8,
            pub kind: Option<u16>,
            pub more: u8,
        }
    );
    shape!(
        removed_field,
        pub struct Sample {
            pub range_m: f64,
            pub source: u8,
        }
    );
    shape!(
        array_of_two,
        pub struct Sample {
            pub range_m: [f64; 2],
            pub source: u8,
            pub kind: Option<u16>,
        }
    );
    shape!(
        array_of_three,
        pub struct Sample {
            pub range_m: [f64; 3],
            pub source: u8,
            pub kind: Option<u16>,
        }
    );
    shape!(
        an_enum,
        pub enum Sample {
            A,
            B,
        }
    );
    shape!(
        renamed_variant,
        pub enum Sample {
            A,
            C,
        }
    );
    shape!(
        swapped_variants,
        pub enum Sample {
            B,
            A,
        }
    );
    shape!(
        variant_with_data,
        pub enum Sample {
            A,
            B(u8),
        }
    );

    #[test]
    fn every_edit_of_a_packet_alters_the_hash() {
        let hashes = [
            schema_hash::<original::Carrier>(),
            schema_hash::<renamed_field::Carrier>(),
            schema_hash::<other_type::Carrier>(),
            schema_hash::<other_inner_type::Carrier>(),
            schema_hash::<other_order::Carrier>(),
            schema_hash::<added_field::Carrier>(),
            schema_hash::<removed_field::Carrier>(),
            schema_hash::<array_of_two::Carrier>(),
            schema_hash::<array_of_three::Carrier>(),
            schema_hash::<an_enum::Carrier>(),
            schema_hash::<renamed_variant::Carrier>(),
            schema_hash::<swapped_variants::Carrier>(),
            schema_hash::<variant_with_data::Carrier>(),
        ];
        for (i, a) in hashes.iter().enumerate() {
            for (j, b) in hashes.iter().enumerate().skip(i + 1) {
                assert_ne!(a, b, "shapes {i} and {j}");
            }
        }
    }

    #[test]
    fn the_same_shape_written_twice_hashes_the_same() {
        shape!(
            twin,
            pub struct Sample {
                pub range_m: f64,
                pub source: u8,
                pub kind: Option<u16>,
            }
        );
        assert_eq!(schema_hash::<twin::Carrier>(), schema_hash::<original::Carrier>());
    }

    #[test]
    fn the_hash_depends_on_both_directions() {
        assert_ne!(SCHEMA_HASH, schema_hash::<Frame<Uplink>>());
        assert_ne!(SCHEMA_HASH, schema_hash::<Frame<Downlink>>());
    }
}

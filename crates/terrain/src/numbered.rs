//! Enums that files hold as one byte: the place of a variant in the list of all, to whose end new ones go.

/// Numbers the variants of an enum by their places in its `ALL`, and writes it as that number.
macro_rules! numbered {
    ($name:ident) => {
        impl $name {
            /// Its number in files.
            pub fn number(self) -> u8 {
                Self::ALL.iter().position(|other| *other == self).expect("the list names every variant") as u8
            }

            /// What has this number in files, if anything does.
            pub fn of_number(number: u8) -> Option<Self> {
                Self::ALL.get(usize::from(number)).copied()
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_u8(self.number())
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let number = u8::deserialize(deserializer)?;
                let unknown = || format!("found {} {number}, expected below {}", stringify!($name), Self::ALL.len());
                Self::of_number(number).ok_or_else(|| serde::de::Error::custom(unknown()))
            }
        }
    };
}
pub(crate) use numbered;

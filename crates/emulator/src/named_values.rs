//! The numbers that a test of a program means by a name: of a variable, or of a point.
//!
//! [`crate::program_test`] compares with them, and [`crate::headless`] places the arm at them.

use ts3100_controller::{ActionError, Controller};
use ts3100_proto::name::NameError;
use ts3100_proto::words::did_you_mean;
use ts3100_recording::program_test::TestPosition;

/// Why a variable has no numbers.
#[derive(Debug, thiserror::Error)]
pub enum ValueError {
    #[error(transparent)]
    Name(#[from] NameError),
    #[error("there is none of this name{hint}")]
    Missing { hint: String },
    #[error("it is an array; name an element, as in `A(2)`")]
    Array,
    #[error("it has no value")]
    Undefined,
}

/// Why a place of a test has no coordinates, or the arm cannot be there.
#[derive(Debug, thiserror::Error)]
pub enum PositionError {
    #[error("position: expected at most {most} coordinates, found {found}")]
    Count { most: usize, found: usize },
    #[error("position: {name} is not a point")]
    NoPoint { name: String },
    #[error("position {name}: {reason}")]
    Value { name: String, reason: ValueError },
    #[error(transparent)]
    Place(#[from] ActionError),
}

/// The numbers of a variable.
///
/// # Errors
/// [`ValueError`]
pub fn numbers_of(controller: &Controller, name: &str) -> Result<Vec<f64>, ValueError> {
    let Some(view) = controller.variable(name)? else {
        let known: Vec<String> = controller.variables().into_iter().map(|view| view.name).collect();
        let upper = format!(".{}", name.to_ascii_uppercase());
        // A variable of a program is named with it.
        let own = known.iter().find(|known| known.ends_with(&upper));
        let hint = match own {
            Some(own) => format!("; did you mean `{own}`?"),
            None => did_you_mean(name, known.iter().map(String::as_str)),
        };
        return Err(ValueError::Missing { hint });
    };
    if !view.bounds.is_empty() {
        return Err(ValueError::Array);
    }
    let value = view.value.ok_or(ValueError::Undefined)?;
    Ok(value.iter().map(|number| number.as_f64()).collect())
}

/// The world coordinates that a place of a test means; those of a point have its configuration at the end.
///
/// # Errors
/// [`PositionError`]
pub fn coordinates_of(controller: &Controller, place: &TestPosition) -> Result<Vec<f64>, PositionError> {
    let most = controller.arm_pose().world_values().len();
    match place {
        TestPosition::Coordinates(numbers) if numbers.len() > most => {
            let found = numbers.len();
            Err(PositionError::Count { most, found })
        }
        TestPosition::Coordinates(numbers) => Ok(numbers.clone()),
        TestPosition::Named(name) => {
            let name = name.clone();
            match numbers_of(controller, &name) {
                Ok(numbers) if numbers.len() == most + 1 => Ok(numbers),
                Ok(_) => Err(PositionError::NoPoint { name }),
                Err(reason) => Err(PositionError::Value { name, reason }),
            }
        }
    }
}

/// Places the arm before the start of a program.
///
/// # Errors
/// [`PositionError`]: the arm stays where it is.
pub fn place_arm(controller: &mut Controller, place: &TestPosition) -> Result<(), PositionError> {
    let coordinates = coordinates_of(controller, place)?;
    Ok(controller.place_arm(&coordinates)?)
}

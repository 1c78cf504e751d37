//! The recipes of the cookbook: each program of `fixtures/scol/cookbook` with its tests, without the line about their origin.

/// The page.
pub const PAGE: &str = "how-to/cookbook.md";

fn recipe(name: &str, program: &'static str, tests: &'static str) -> String {
    let body = |text: &'static str| text.split_once('\n').map_or(text, |(_, body)| body).trim_end();
    let (program, tests) = (body(program), body(tests));
    format!(
        "<!-- ci:check -->\n```scol\n{program}\n```\n\nIts tests, `{name}.test.toml`:\n\n```toml\n{tests}\n```"
    )
}

/// Makes the function of each recipe.
macro_rules! recipes {
    ($($name:ident)*) => { $(
        pub fn $name() -> String {
            recipe(
                stringify!($name),
                include_str!(concat!("../../../fixtures/scol/cookbook/", stringify!($name), ".scol")),
                include_str!(concat!("../../../fixtures/scol/cookbook/", stringify!($name), ".test.toml")),
            )
        }
    )* };
}

recipes!(pallet vision two_tasks monitors recovery subprograms hand conveyor);

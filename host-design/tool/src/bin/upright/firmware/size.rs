//! `upright firmware size`

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use upright_tool::image::{
    ImagePart, LinkedImage, StackBound, StackError, forbidden_functions, size, stack_bound, wrong_functions,
};

use super::board::BoardOption;
use super::built::{CodeOrigin, built};
use crate::variation::Wanted;
use upright_command::Failure;
use upright_command::print;

/// Measures the image of a board: flash and RAM by section and by crate, a bound on its stack, and whether it can
/// panic; exit status 1 if it may take more stack than is reserved, or if it can panic or allocate. An image that does
/// not fit the flash and the RAM of its chip is not even linked. The crates for USB in the image of a Pico can panic;
/// there, the exit status is 1 if an interrupt can, such as the tick.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright firmware size                                       builds it with src/gains.rs as it is
  upright firmware size rigs/single-quanser-ip02.toml --board nucleo-f446
  upright firmware size rigs/single-quanser-ip02.toml --board pico
  upright firmware size --elf target/image.elf --json | jq .stack.bytes")]
pub(crate) struct SizeCommand {
    /// Rig file (TOML) to design the table from [default: the table in src/gains.rs]
    rig: Option<PathBuf>,
    #[command(flatten)]
    on: BoardOption,
    /// Measure this image instead of building one
    #[arg(long, value_name = "FILE", conflicts_with_all = ["rig", "board"])]
    elf: Option<PathBuf>,
    /// Print the figures as one JSON object
    #[arg(long)]
    json: bool,
}

impl SizeCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let path = match self.elf {
            Some(path) => path,
            None => {
                built(self.on.board, self.rig.as_deref(), Wanted::SwingUp, CodeOrigin::Compiled)?.image.elf
            }
        };
        let image = LinkedImage::read(&path)?;
        let (size, stack, forbidden) = (size(&image)?, stack_bound(&image), forbidden_functions(&image));
        let wrong = wrong(&stack, &wrong_functions(&image).unwrap_or_default());
        let object = json!({
            "image": path,
            "flash": size.flash,
            "ram": size.ram,
            "tables": size.tables,
            "table": size.table,
            "constants": size.constants,
            "copied": size.copied,
            "sections": size.sections,
            "crates": size.crates,
            "stack": stack.as_ref().ok(),
            "forbidden_functions": forbidden,
            "wrong": wrong,
        });
        print(self.json, &object, || table(&size, &stack))?;
        if wrong.is_empty() { Ok(()) } else { Err(Failure::check(wrong.join("; "))) }
    }
}

/// The violated limits, as text.
fn wrong(stack: &Result<StackBound, StackError>, forbidden: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    match stack {
        Ok(StackBound { bytes, reserved, .. }) if bytes > reserved => {
            wrong.push(format!("stack: {bytes} bytes, {} above the limit of {reserved}", bytes - reserved));
        }
        Ok(_) => {}
        Err(error) => wrong.push(error.to_string()),
    }
    if !forbidden.is_empty() {
        wrong.push(format!("it can panic or allocate: it contains {}", forbidden.join(", ")));
    }
    wrong
}

fn table(size: &upright_tool::image::Size, stack: &Result<StackBound, StackError>) -> String {
    let mut text = String::new();
    let mut rows = |head: &str, parts: &[ImagePart]| {
        // Writing to a string cannot fail.
        _ = writeln!(text, "{head:<40} {:>8} {:>8}", "flash", "RAM");
        for part in parts {
            _ = writeln!(text, "  {:<38} {:>8} {:>8}", part.name, part.flash, part.ram);
        }
        _ = writeln!(text);
    };
    rows("section (bytes)", &size.sections);
    rows("crate (bytes)", &size.crates);
    let all = [
        ImagePart { name: "sum".to_owned(), flash: size.flash, ram: size.ram },
        ImagePart { name: "without tables".to_owned(), flash: size.code(), ram: size.variables() },
    ];
    rows("image (bytes)", &all);
    if let Ok(stack) = stack {
        _ = writeln!(text, "{:<40} {:>8}", "stack, at most (bytes)", "");
        for level in &stack.levels {
            let deepest: Vec<&str> = level.chain.iter().map(|name| short(name)).collect();
            _ = writeln!(text, "  {:<47} {:>8}", deepest.join(" → "), level.bytes);
        }
        _ = writeln!(text, "  {:<47} {:>8}", "sum, each interrupting the one above", stack.bytes);
        _ = writeln!(text, "  {:<47} {:>8}", "limit", stack.reserved);
    }
    text
}

/// The last part of a path, without generic parameters.
fn short(name: &str) -> &str {
    let plain = name.split("::<").next().unwrap_or(name);
    plain.rsplit("::").next().unwrap_or(plain).trim_end_matches('>')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_above_what_is_reserved_is_reported_and_one_below_is_not() {
        let wrong = |bytes| {
            let stack = Ok(StackBound { bytes, reserved: 5120, levels: Vec::new() });
            wrong(&stack, &[]).len()
        };
        assert_eq!([5120, 5121].map(wrong), [0, 1]);
    }
}

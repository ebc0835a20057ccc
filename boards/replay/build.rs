//! Chooses the linker's scripts: one for the memory of QEMU's machine, one for the sections.

use std::path::PathBuf;

fn main() {
    let target = std::env::var("TARGET").unwrap_or_default();
    let script = match target.split('-').next() {
        Some("thumbv8m.main") => "armv8m.ld",
        Some(arm) if arm.starts_with("thumb") => "arm.ld",
        _ => "riscv.ld",
    };
    println!("cargo::rustc-check-cfg=cfg(armv6m)");
    if target.starts_with("thumbv6m") {
        println!("cargo::rustc-cfg=armv6m");
    }
    let folder = PathBuf::from(std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default()).join("memory");
    for script in [script, "sections.ld"] {
        println!("cargo::rustc-link-arg=-T{}", folder.join(script).display());
    }
    println!("cargo::rerun-if-changed={}", folder.display());
}

//! The drive that a Raspberry Pi Pico or Pico 2 shows while BOOTSEL is held at power-on.

use std::path::{Path, PathBuf};

use upright::boards::BoardRow;

use upright_command::Failure;

/// A file that the boot loader puts on its drive. A line of it names the board.
const INFO: &str = "INFO_UF2.TXT";

/// Copies a UF2 file to the drive with this name. The board then restarts with it.
pub(super) fn copy_to_drive(board: &BoardRow, name: &str, uf2: &Path) -> Result<(), Failure> {
    let Some(drive) = drive(name, &places()) else {
        return Err(Failure::check(format!(
            "no {}: hold its BOOTSEL button while you plug it in, and run this again; or copy {} to the drive {}",
            board.product,
            uf2.display(),
            name
        )));
    };
    std::fs::copy(uf2, drive.join("upright.uf2"))?;
    println!("copied to {}: the {} restarts with it", drive.display(), board.product);
    Ok(())
}

/// Folders in which drives appear.
fn places() -> Vec<PathBuf> {
    if cfg!(windows) {
        return vec![];
    }
    let users = |folder: &str| -> Vec<PathBuf> { folders(Path::new(folder)) };
    let mut places = vec![PathBuf::from("/Volumes"), PathBuf::from("/media"), PathBuf::from("/mnt")];
    places.extend(users("/media").into_iter().chain(users("/run/media")));
    places
}

/// The drive with this name: in one of these folders, or a drive letter of Windows.
fn drive(name: &str, places: &[PathBuf]) -> Option<PathBuf> {
    let line = format!("Board-ID: {name}");
    let letters = ('D'..='Z').filter(|_| cfg!(windows)).map(|letter| PathBuf::from(format!("{letter}:\\")));
    let mounted = places.iter().flat_map(|place| folders(place)).chain(letters);
    mounted.into_iter().find(|folder| {
        std::fs::read_to_string(folder.join(INFO))
            .is_ok_and(|text| text.lines().any(|text_line| text_line.trim() == line))
    })
}

fn folders(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    entries.flatten().map(|entry| entry.path()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_drive_of_this_board_is_found() {
        let place = tempfile::tempdir().unwrap();
        let stick = place.path().join("stick");
        std::fs::create_dir(&stick).unwrap();
        std::fs::write(stick.join(INFO), "UF2 Bootloader\nBoard-ID: another\n").unwrap();
        assert_eq!(drive("RPI-RP2", &[place.path().to_owned()]), None);
        let pico = place.path().join("RPI-RP2");
        std::fs::create_dir(&pico).unwrap();
        std::fs::write(
            pico.join(INFO),
            "UF2 Bootloader v3.0\r\nModel: Raspberry Pi RP2\r\nBoard-ID: RPI-RP2\r\n",
        )
        .unwrap();
        assert_eq!(drive("RPI-RP2", &[place.path().to_owned()]), Some(pico));
        assert_eq!(drive("RP2350", &[place.path().to_owned()]), None);
    }
}

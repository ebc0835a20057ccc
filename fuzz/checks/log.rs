//! Bytes of a log: either a log that is the same after it is written and read again, or an error of one line.

use upright::table::checksum::crc32;
use upright_identify::Log;

/// First bytes of a log.
const MAGIC: &[u8] = b"UPRTLOG1";

/// Reads `bytes` as a log: as they are, and with the right checksums put in, to get past their check.
///
/// # Panics
/// If a log is not the same when it is read again, or an error is not one line.
pub fn check(bytes: &[u8]) {
    read(bytes);
    read(&sealed(bytes));
}

fn read(bytes: &[u8]) {
    match Log::from_bytes(bytes) {
        Ok(log) => {
            assert_eq!(Log::from_bytes(&log.to_bytes()).as_ref(), Ok(&log));
            assert_eq!(log.deviations().len(), log.ticks().len() * log.channels());
            assert!(log.lost() <= u64::from(u32::MAX));
            let steps = vec![1e-3; log.channels()];
            log.write_csv(&steps, &mut std::io::sink()).expect("nothing is written");
            log.write_mcap(&steps, &mut std::io::sink()).expect("nothing is written");
        }
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
        }
    }
}

/// `bytes` with the first bytes of a log and the right checksum after the header and after each frame, as far as
/// `bytes` reach.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut sealed = bytes.to_vec();
    let Some(begin) = sealed.get_mut(..MAGIC.len()) else { return sealed };
    begin.copy_from_slice(MAGIC);
    let (Some(&channels), Some(&name)) = (bytes.get(8), bytes.get(10)) else { return sealed };
    let channels = usize::from(channels);
    let mut from = MAGIC.len();
    let mut length = 3 + usize::from(name) + 20 + 2 * channels;
    while let Some((body, rest)) = sealed[from..].split_at_mut_checked(length) {
        let Some(crc) = rest.first_chunk_mut::<4>() else { break };
        *crc = crc32(0, body).to_le_bytes();
        from += length + 4;
        let Some(&ticks) = sealed.get(from + 4) else { break };
        length = 8 + usize::from(ticks) * 2 * (channels + 1);
    }
    sealed
}

//! Content security policies of pages in one file: they name the scripts and styles in the page by their hashes.

use sha2::{Digest, Sha256};

/// The hash by which a policy names a script or style, without its quotation marks.
pub(crate) fn source(text: &str) -> String {
    format!("sha256-{}", base64(&Sha256::digest(text)))
}

/// The policy of a document that runs at most this script, has this style, and asks for nothing.
pub(crate) fn of_document(script: Option<&str>, style: &str) -> String {
    let script = script.map_or("'none'".to_owned(), |script| format!("'{}'", source(script)));
    format!(
        "default-src 'none'; script-src {script}; style-src '{}'; img-src data:; base-uri 'none'; form-action 'none'",
        source(style)
    )
}

/// Bytes in the letters of RFC 4648.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word =
            three.iter().enumerate().fold(0, |word, (i, &byte)| word | u32::from(byte) << (16 - 8 * i));
        for place in 0..4 {
            let letter = char::from(LETTERS[(word >> (18 - 6 * place) & 63) as usize]);
            text.push(if place <= three.len() { letter } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_the_letters_of_the_standard() {
        // RFC 4648, section 10.
        for (bytes, text) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }
}

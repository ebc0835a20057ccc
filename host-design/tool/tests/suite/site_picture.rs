//! The picture of the page in its guide is that of the page as it is.
//!
//! With `UPRIGHT_BLESS=1` and `UPRIGHT_REQUIRE_WASM=1`, `cargo test -p upright-tool --test suite site_picture` makes it
//! again, in Chromium.

use crate::site_page::{opened_in, root, until};

const PICTURE: &str = "docs/site.png";
const GUIDE: &str = "docs/site.md";
const SIZE: [u32; 2] = [1280, 800];
/// What decides how the page looks.
const LOOK: [&str; 2] =
    [include_str!("../../src/site/page/desk.html"), include_str!("../../src/site/page/desk.css")];

/// A sum over the look of the page, by which the guide knows which page its picture shows.
fn sum(look: &[&str]) -> String {
    let bytes = look.iter().flat_map(|text| text.bytes());
    let sum = bytes
        .fold(0xcbf2_9ce4_8422_2325_u64, |sum, byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    format!("<!-- site.png: {sum:016x} -->")
}

fn bytes_of_letters(letters: &str) -> Vec<u8> {
    let value = |letter: u8| match letter {
        b'A'..=b'Z' => letter - b'A',
        b'a'..=b'z' => letter - b'a' + 26,
        b'0'..=b'9' => letter - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let letters = letters.trim_end_matches('=').as_bytes();
    let four = |four: &[u8]| {
        let word = four
            .iter()
            .enumerate()
            .fold(0, |word, (i, &letter)| word | u32::from(value(letter)) << (18 - 6 * i));
        word.to_be_bytes()[1..four.len()].to_vec()
    };
    letters.chunks(4).flat_map(four).collect()
}

/// Makes the picture again, where a browser and the page's module are.
fn bless() {
    let Some((mut browser, _folder)) = opened_in(SIZE[0]) else { return };
    until(&mut browser, "upright.desk.survival && upright.live().latest");
    std::fs::write(root().join(PICTURE), bytes_of_letters(&browser.picture(SIZE))).unwrap();
    let guide = std::fs::read_to_string(root().join(GUIDE)).unwrap();
    let begin = guide.find("<!-- site.png: ").expect("the guide says which page its picture shows");
    let end = begin + guide[begin..].find("-->").unwrap() + 3;
    std::fs::write(root().join(GUIDE), [&guide[..begin], &sum(&LOOK), &guide[end..]].concat()).unwrap();
}

#[test]
fn the_picture_in_the_guide_is_that_of_the_page_as_it_is() {
    if std::env::var_os("UPRIGHT_BLESS").is_some() {
        bless();
    }
    let guide = std::fs::read_to_string(root().join(GUIDE)).unwrap();
    assert!(
        guide.contains(&sum(&LOOK)),
        "{PICTURE} shows another page: the head of this file says how to make it again"
    );
    let png = std::fs::read(root().join(PICTURE)).unwrap();
    let size = [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()));
    assert_eq!(size, SIZE);
    // Negative control: another look.
    assert!(!guide.contains(&sum(&[LOOK[0], "body { color: red; }"])));
}

//! The plant of a rig file: `[cart]`, `[[link]]` and `[gravity]`, or `[model]`.

use crate::rig::error::RigError;
use crate::rig::node::{Node, Section};
use crate::rig::rule::Rule;
use crate::rig::{Cart, Chain, LinearPlant, Link, LinkEncoder, MAX_LINKS, PlantDescription, defaults};

/// Highest order of a linear model.
const MOST_STATES: usize = 60;

/// Keys of `[cart]`.
pub(super) const CART_KEYS: &[&str] = &["mass_kg", "friction_n_s_per_m", "travel_m", "encoder_step_m"];
/// Keys of `[model]`.
pub(super) const MODEL_KEYS: &[&str] = &["a", "b", "output", "measured", "measured_steps", "noise_input"];
const LINK_KEYS: &[&str] = &[
    "mass_kg",
    "length_m",
    "centre_of_mass_m",
    "inertia_kg_m2",
    "friction_n_m_s_per_rad",
    "encoder_step_rad",
    "encoder_counts_per_rev",
];

/// The plant, described in one of the two ways.
pub(super) fn plant(root: &Section<'_>) -> Result<PlantDescription, RigError> {
    const ONE: &str = "keep [model], or [cart] with its [[link]]s and [gravity], not both";
    for part in ["cart", "link", "gravity"] {
        root.not_both("model", part, ONE)?;
    }
    match root.get("model") {
        Some(node) => model(&node).map(PlantDescription::Model),
        None => chain(root).map(PlantDescription::Chain),
    }
}

fn chain(root: &Section<'_>) -> Result<Chain, RigError> {
    const LINKS: &str = "one [[link]] table per link, from the cart outwards";
    let cart = root.need("cart", "[cart] and its [[link]]s, or [model]: the plant is not described")?;
    let cart = self::cart(&cart)?;
    let links = root.need("link", LINKS)?;
    let entries = links.list("a list of tables", LINKS)?;
    if !(1..=MAX_LINKS).contains(&entries.len()) {
        return Err(links.wrong_length(entries.len(), &format!("1 to {MAX_LINKS}"), LINKS));
    }
    Ok(Chain {
        cart,
        links: entries.iter().map(link).collect::<Result<_, _>>()?,
        gravity_m_per_s2: root
            .get("gravity")
            .map_or(Ok(defaults::GRAVITY_M_PER_S2), |node| gravity(&node))?,
    })
}

fn cart(node: &Node<'_>) -> Result<Cart, RigError> {
    let table = node.section(CART_KEYS)?;
    Ok(Cart {
        mass_kg: table.number(
            "mass_kg",
            Rule::POSITIVE,
            "the mass of the cart in kg, with the equivalent mass of belt, gear and motor",
        )?,
        friction_n_s_per_m: table
            .number_if_given(
                "friction_n_s_per_m",
                Rule::NOT_NEGATIVE,
                "the viscous friction of the cart in N·s/m",
            )?
            .unwrap_or(defaults::FRICTION),
        travel_m: table.get("travel_m").map_or(Ok(defaults::TRAVEL_M), |node| travel(&node))?,
        encoder_step_m: table.number_if_given(
            "encoder_step_m",
            Rule::POSITIVE,
            "the travel per encoder count in m",
        )?,
    })
}

fn travel(node: &Node<'_>) -> Result<[f64; 2], RigError> {
    const MEANING: &str =
        "both ends of the rail in m, as [-0.4, 0.4], with the start position 0 between them";
    let ends = node.numbers(2, Rule::ANY, MEANING)?;
    match ends[..] {
        [low, high] if low < 0.0 && high > 0.0 => Ok([low, high]),
        _ => Err(node.out_of_range("[a number < 0, a number > 0]", &format!("give {MEANING}"))),
    }
}

fn link(node: &Node<'_>) -> Result<Link, RigError> {
    let table = node.section(LINK_KEYS)?;
    let length_m = table.number(
        "length_m",
        Rule::POSITIVE,
        "the length of the link in m, from its joint to the next one (or to its tip)",
    )?;
    Ok(Link {
        mass_kg: table.number("mass_kg", Rule::POSITIVE, "the mass of the link in kg")?,
        length_m,
        centre_of_mass_m: table
            .get("centre_of_mass_m")
            .map(|node| centre_of_mass(&node, length_m))
            .transpose()?,
        inertia_kg_m2: table.number_if_given(
            "inertia_kg_m2",
            Rule::NOT_NEGATIVE,
            "the moment of inertia about the centre of mass in kg·m² (0 for a point mass), or leave it out \
             for a uniform rod",
        )?,
        friction_n_m_s_per_rad: table
            .number_if_given(
                "friction_n_m_s_per_rad",
                Rule::NOT_NEGATIVE,
                "the viscous friction in the link's lower joint in N·m·s/rad",
            )?
            .unwrap_or(defaults::FRICTION),
        encoder: link_encoder(&table)?,
    })
}

/// The centre of mass may lie beyond the next joint (a link with an extension), but not far beyond.
fn centre_of_mass(node: &Node<'_>, length_m: f64) -> Result<f64, RigError> {
    const MEANING: &str = "the distance from the joint to the centre of mass in m";
    let distance = node.number(Rule::POSITIVE, MEANING)?;
    if distance > 10.0 * length_m {
        return Err(node.out_of_range(
            &format!("a number > 0 and <= 10 times length_m, {} (m)", 10.0 * length_m),
            &format!("give {MEANING}, or correct length_m"),
        ));
    }
    Ok(distance)
}

fn link_encoder(table: &Section<'_>) -> Result<Option<LinkEncoder>, RigError> {
    table.not_both("encoder_step_rad", "encoder_counts_per_rev", "keep the one the data sheet gives")?;
    let step =
        table.number_if_given("encoder_step_rad", Rule::ANGLE, "the angle per encoder count in rad")?;
    let counts = table.number_if_given(
        "encoder_counts_per_rev",
        Rule::COUNTS,
        "the encoder counts per revolution after quadrature (four per line)",
    )?;
    Ok(step.map(LinkEncoder::StepRad).or(counts.map(LinkEncoder::CountsPerRev)))
}

fn gravity(node: &Node<'_>) -> Result<f64, RigError> {
    node.section(&["m_per_s2"])?.number(
        "m_per_s2",
        Rule::POSITIVE,
        "the acceleration of gravity in m/s², about 9.81, or leave [gravity] out",
    )
}

fn model(node: &Node<'_>) -> Result<LinearPlant, RigError> {
    const A: &str = "the rows of A, as [[0, 1], [2, 0]], square";
    const B: &str = "the entries of B, one per state: the model has a single input";
    let table = node.section(MODEL_KEYS)?;
    let a_node = table.need("a", A)?;
    let rows = a_node.list("a list of rows", A)?;
    let states = rows.len();
    if !(1..=MOST_STATES).contains(&states) {
        return Err(a_node.wrong_length(states, &format!("1 to {MOST_STATES} rows"), A));
    }
    let a = rows.iter().map(|row| row.numbers(states, Rule::ANY, A)).collect::<Result<_, _>>()?;
    let b = table.need("b", B)?.numbers(states, Rule::ANY, B)?;
    let output = match table.get("output") {
        Some(node) => state_index(&node, states)?,
        None => defaults::OUTPUT,
    };
    let measured = match table.get("measured") {
        Some(node) => measured(&node, states)?,
        None => vec![output],
    };
    let steps = "the step of each measured state's sensor, in the state's unit";
    let measured_steps = match table.get("measured_steps") {
        Some(node) => node.numbers(measured.len(), Rule::POSITIVE, steps)?,
        None => Vec::new(),
    };
    let noise_input = table.get("noise_input").map(|node| noise_input(&node, states)).transpose()?;
    Ok(LinearPlant { a, b, output, measured, measured_steps, noise_input })
}

fn state_index(node: &Node<'_>, states: usize) -> Result<usize, RigError> {
    node.index(
        states - 1,
        &format!("a whole number from 0 to {}", states - 1),
        "the index of a state, counted from 0",
    )
}

fn measured(node: &Node<'_>, states: usize) -> Result<Vec<usize>, RigError> {
    const MEANING: &str = "the indices of the measured states, counted from 0, each once";
    let entries = node.list("a list of state indices", MEANING)?;
    if !(1..=states).contains(&entries.len()) {
        return Err(node.wrong_length(entries.len(), &format!("1 to {states}"), MEANING));
    }
    let mut indices = Vec::with_capacity(entries.len());
    for entry in &entries {
        let index = state_index(entry, states)?;
        if indices.contains(&index) {
            return Err(entry.out_of_range("each state once", &format!("give {MEANING}")));
        }
        indices.push(index);
    }
    Ok(indices)
}

fn noise_input(node: &Node<'_>, states: usize) -> Result<Vec<Vec<f64>>, RigError> {
    const MEANING: &str = "the columns through which noise enters, each with one entry per state";
    let columns = node.list("a list of columns", MEANING)?;
    if !(1..=states).contains(&columns.len()) {
        return Err(node.wrong_length(columns.len(), &format!("1 to {states} columns"), MEANING));
    }
    columns.iter().map(|column| column.numbers(states, Rule::ANY, MEANING)).collect()
}

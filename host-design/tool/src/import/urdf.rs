//! Links and joints of a URDF (<http://wiki.ros.org/urdf/XML>), as they are in the file.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use super::error::ImportError;

/// A robot.
#[derive(Debug)]
pub(super) struct Robot {
    pub(super) name: String,
    pub(super) links: Vec<RobotLink>,
    pub(super) joints: Vec<RobotJoint>,
}

/// A link, in its own frame.
#[derive(Debug)]
pub(super) struct RobotLink {
    pub(super) name: String,
    pub(super) body: Body,
}

/// Mass, centre of mass (m) and inertia about it (kg·m²).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Body {
    pub(super) mass_kg: f64,
    pub(super) centre: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
}

/// A joint.
#[derive(Debug)]
pub(super) struct RobotJoint {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) parent: String,
    pub(super) child: String,
    /// From the child's frame to the parent's.
    pub(super) origin: Isometry3<f64>,
    /// In the child's frame.
    pub(super) axis: Vector3<f64>,
    /// Viscous and dry friction (N·s/m and N, or N·m·s/rad and N·m).
    pub(super) friction: [f64; 2],
    /// Lower and upper end (m, rad).
    pub(super) ends: Option<[f64; 2]>,
    /// Largest force and speed (N and m/s, or N·m and rad/s).
    pub(super) most: [f64; 2],
}

impl Robot {
    pub(super) fn read(text: &str) -> Result<Self, ImportError> {
        let document = Document::parse(text)?;
        let robot = document.root_element();
        if !robot.has_tag_name("robot") {
            return Err(ImportError::NotUrdf(robot.tag_name().name().to_owned()));
        }
        let all = |tag: &'static str| robot.children().filter(move |node| node.has_tag_name(tag));
        Ok(Self {
            name: robot.attribute("name").unwrap_or("imported").to_owned(),
            links: all("link").map(link).collect::<Result<_, _>>()?,
            joints: all("joint").map(joint).collect::<Result<_, _>>()?,
        })
    }
}

fn link(node: Node<'_, '_>) -> Result<RobotLink, ImportError> {
    let name = text(node, "name")?;
    let Some(inertial) = child(node, "inertial") else {
        return Ok(RobotLink { name, body: Body::default() });
    };
    let frame = origin(inertial)?;
    let mass = child(inertial, "mass").ok_or_else(|| missing(inertial, "<mass>"))?;
    let [mass_kg] = numbers(mass, "value")?.ok_or_else(|| missing(mass, "value"))?;
    let mut inertia = Matrix3::zeros();
    if let Some(node) = child(inertial, "inertia") {
        for (name, row, column) in
            [("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2)]
        {
            let [entry] = numbers(node, name)?.unwrap_or([0.0]);
            (inertia[(row, column)], inertia[(column, row)]) = (entry, entry);
        }
    }
    let turned = frame.rotation.to_rotation_matrix();
    let body = Body {
        mass_kg,
        centre: frame.translation.vector,
        inertia: turned.matrix() * inertia * turned.matrix().transpose(),
    };
    Ok(RobotLink { name, body })
}

fn joint(node: Node<'_, '_>) -> Result<RobotJoint, ImportError> {
    let link = |tag: &'static str, what| text(child(node, tag).ok_or_else(|| missing(node, what))?, "link");
    let axis = match child(node, "axis") {
        Some(axis) => numbers(axis, "xyz")?.ok_or_else(|| missing(axis, "xyz"))?,
        None => [1.0, 0.0, 0.0],
    };
    let of = |tag: &str, name: &'static str| match child(node, tag) {
        Some(found) => Ok::<_, ImportError>(numbers(found, name)?.map(|[number]| number)),
        None => Ok(None),
    };
    let kind = text(node, "type")?;
    let ends = match (kind.as_str(), of("limit", "lower")?, of("limit", "upper")?) {
        ("continuous", ..) | (_, None, None) => None,
        (_, lower, upper) => Some([lower.unwrap_or(0.0), upper.unwrap_or(0.0)]),
    };
    Ok(RobotJoint {
        name: text(node, "name")?,
        kind,
        parent: link("parent", "<parent>")?,
        child: link("child", "<child>")?,
        origin: origin(node)?,
        axis: Vector3::from(axis),
        friction: [of("dynamics", "damping")?.unwrap_or(0.0), of("dynamics", "friction")?.unwrap_or(0.0)],
        ends,
        most: [of("limit", "effort")?.unwrap_or(0.0), of("limit", "velocity")?.unwrap_or(0.0)],
    })
}

/// `<origin xyz rpy>`: fixed-axis roll, pitch, yaw.
fn origin(node: Node<'_, '_>) -> Result<Isometry3<f64>, ImportError> {
    let Some(origin) = child(node, "origin") else { return Ok(Isometry3::identity()) };
    let [x, y, z] = numbers(origin, "xyz")?.unwrap_or_default();
    let [roll, pitch, yaw] = numbers(origin, "rpy")?.unwrap_or_default();
    let turned = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), turned))
}

fn child<'a, 'd>(node: Node<'a, 'd>, tag: &str) -> Option<Node<'a, 'd>> {
    node.children().find(|child| child.has_tag_name(tag))
}

fn text(node: Node<'_, '_>, name: &'static str) -> Result<String, ImportError> {
    node.attribute(name).map(str::to_owned).ok_or_else(|| missing(node, name))
}

/// The numbers of an attribute, if it is there.
fn numbers<const N: usize>(node: Node<'_, '_>, name: &'static str) -> Result<Option<[f64; N]>, ImportError> {
    let Some(value) = node.attribute(name) else { return Ok(None) };
    let numbers: Option<Vec<f64>> =
        value.split_whitespace().map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
        Some(numbers) => Ok(Some(numbers)),
        None => {
            Err(ImportError::Numbers { line: line(node), attribute: name, value: value.to_owned(), count: N })
        }
    }
}

fn missing(node: Node<'_, '_>, what: &'static str) -> ImportError {
    ImportError::Missing { line: line(node), element: node.tag_name().name().to_owned(), what }
}

fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

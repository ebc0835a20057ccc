//! The machine of a URDF as a cart and a chain of hinges.

use nalgebra::{Isometry3, Vector3};

use super::error::ImportError;
use super::urdf::{Body, Robot, RobotJoint};
use crate::simulator_model::TIP;

/// Directions that agree to this sine count as the same.
const SAME: f64 = 1e-3;
/// A centre of mass may be off the line between the joints by this share of the link's length.
const OFF_LINE: f64 = 0.01;

/// A cart on a level rail, and the links on it.
pub(super) struct Machine<'r> {
    pub(super) cart_kg: f64,
    pub(super) slide: &'r RobotJoint,
    pub(super) links: Vec<HingedLink<'r>>,
}

/// A link, with what it has in the plane of the chain.
pub(super) struct HingedLink<'r> {
    pub(super) hinge: &'r RobotJoint,
    pub(super) mass_kg: f64,
    /// Distance to the next hinge, or to the tip (m); `None` if the file does not say.
    pub(super) length_m: Option<f64>,
    /// Distance of the centre of mass from the hinge (m).
    pub(super) centre_m: f64,
    /// About the centre of mass (kg·m²).
    pub(super) inertia_kg_m2: f64,
}

/// What moves together: the joint that it moves in, the body, the pose of the joint, and where the tip is; all in the
/// world's frame.
struct MovingPart<'r> {
    joint: Option<&'r RobotJoint>,
    pose: Isometry3<f64>,
    body: Body,
    tip: Option<Vector3<f64>>,
}

impl MovingPart<'_> {
    fn axis(&self) -> Vector3<f64> {
        self.joint.map_or(Vector3::zeros(), |joint| (self.pose.rotation * joint.axis).normalize())
    }
}

impl<'r> Machine<'r> {
    pub(super) fn of(robot: &'r Robot) -> Result<Self, ImportError> {
        let parts = parts(robot)?;
        let [_, cart, hinged @ ..] = &parts[..] else { return Err(ImportError::TooShort("prismatic joint")) };
        let Some(slide) = cart.joint else { return Err(ImportError::TooShort("prismatic joint")) };
        let turns = ["continuous", "revolute"].contains(&slide.kind.as_str());
        if turns && cart.axis().cross(&Vector3::z()).norm() < SAME {
            return Err(ImportError::Rotary(slide.name.clone()));
        }
        if slide.kind != "prismatic" {
            let needed = "prismatic, for the cart on its rail";
            return Err(ImportError::Type { joint: slide.name.clone(), kind: slide.kind.clone(), needed });
        }
        let along = cart.axis();
        let bad_axis = |joint: &RobotJoint, needed| ImportError::Axis { joint: joint.name.clone(), needed };
        // An axis without a direction is not level either.
        let is_level = along.z.abs() < SAME;
        if !is_level {
            return Err(bad_axis(slide, "level: z points up"));
        }
        if cart.body.mass_kg <= 0.0 {
            return Err(ImportError::Without { joint: slide.name.clone(), what: "mass" });
        }
        let across = Vector3::z().cross(&along).normalize();
        let mut links = Vec::new();
        for (number, part) in hinged.iter().enumerate() {
            let Some(hinge) = part.joint else { continue };
            if !["continuous", "revolute"].contains(&hinge.kind.as_str()) {
                let needed = "continuous or revolute, for a hinge";
                return Err(ImportError::Type {
                    joint: hinge.name.clone(),
                    kind: hinge.kind.clone(),
                    needed,
                });
            }
            let is_across = part.axis().cross(&across).norm() < SAME;
            if !is_across {
                return Err(bad_axis(hinge, "level and at right angles to the rail"));
            }
            links.push(hinged_link(hinge, part, hinged.get(number + 1), across)?);
        }
        if links.is_empty() {
            return Err(ImportError::TooShort("hinge on the cart"));
        }
        Ok(Self { cart_kg: cart.body.mass_kg, slide, links })
    }
}

fn hinged_link<'r>(
    hinge: &'r RobotJoint,
    part: &MovingPart<'r>,
    next: Option<&MovingPart<'r>>,
    across: Vector3<f64>,
) -> Result<HingedLink<'r>, ImportError> {
    let in_plane = |v: Vector3<f64>| v - across * across.dot(&v);
    let without = |what| ImportError::Without { joint: hinge.name.clone(), what };
    let Body { mass_kg, centre, inertia } = part.body;
    if mass_kg <= 0.0 {
        return Err(without("mass"));
    }
    let from_hinge = in_plane(centre - part.pose.translation.vector);
    let end = next.map(|next| next.pose.translation.vector).or(part.tip);
    let to_next = end.map(|end| in_plane(end - part.pose.translation.vector));
    let line = to_next.unwrap_or(from_hinge);
    let length_m = line.norm();
    if length_m < 1e-6 {
        return Err(without(if end.is_some() {
            "length"
        } else {
            "distance from its joint to its centre of mass"
        }));
    }
    let centre_m = from_hinge.dot(&line) / length_m;
    let off_m = (from_hinge - line * (centre_m / length_m)).norm();
    if off_m > OFF_LINE * length_m || centre_m <= 0.0 {
        return Err(ImportError::OffLine { joint: hinge.name.clone(), off_m: off_m.max(-centre_m) });
    }
    let inertia_kg_m2 = (across.transpose() * inertia * across)[0];
    Ok(HingedLink { hinge, mass_kg, length_m: to_next.map(|_| length_m), centre_m, inertia_kg_m2 })
}

/// The parts from the ground outwards, with the bodies that are fixed to each other as one.
fn parts(robot: &Robot) -> Result<Vec<MovingPart<'_>>, ImportError> {
    for joint in &robot.joints {
        for link in [&joint.parent, &joint.child] {
            if !robot.links.iter().any(|known| known.name == *link) {
                return Err(ImportError::NoLink { joint: joint.name.clone(), link: link.clone() });
            }
        }
    }
    let is_child = |name: &str| robot.joints.iter().any(|joint| joint.child == name);
    let roots: Vec<&str> =
        robot.links.iter().map(|link| link.name.as_str()).filter(|name| !is_child(name)).collect();
    let [root] = roots[..] else { return Err(ImportError::Roots(roots.join(", "))) };
    let (mut parts, mut at) = (Vec::new(), Some((None, root, Isometry3::identity())));
    // A chain visits each link once; the bound ends a circle.
    while let Some((joint, link, pose)) = at.take().filter(|_| parts.len() <= robot.links.len()) {
        let (mut body, mut tip) = (Body::default(), None);
        let mut moving: Vec<(&RobotJoint, Isometry3<f64>)> = Vec::new();
        let mut fixed = vec![(link, pose)];
        while let Some((link, pose)) = fixed.pop() {
            for one in robot.links.iter().filter(|one| one.name == link) {
                body = together(body, moved(one.body, pose));
                let is_tip = one.name == TIP && one.body.mass_kg == 0.0;
                tip = tip.or(is_tip.then_some(pose.translation.vector));
            }
            for next in robot.joints.iter().filter(|next| next.parent == link) {
                let pose = pose * next.origin;
                match next.kind.as_str() {
                    "fixed" => fixed.push((next.child.as_str(), pose)),
                    _ => moving.push((next, pose)),
                }
            }
        }
        parts.push(MovingPart { joint, pose, body, tip });
        match moving[..] {
            [] => {}
            [(next, pose)] => at = Some((Some(next), next.child.as_str(), pose)),
            [(first, _), (second, _), ..] => {
                let [first, second] = [first, second].map(|joint| joint.name.clone());
                return Err(ImportError::Branch { first, second });
            }
        }
    }
    Ok(parts)
}

/// A body in another frame.
fn moved(body: Body, pose: Isometry3<f64>) -> Body {
    let turned = pose.rotation.to_rotation_matrix();
    Body {
        mass_kg: body.mass_kg,
        centre: pose.rotation * body.centre + pose.translation.vector,
        inertia: turned.matrix() * body.inertia * turned.matrix().transpose(),
    }
}

/// Two bodies as one, by Steiner's theorem.
fn together(a: Body, b: Body) -> Body {
    let mass_kg = a.mass_kg + b.mass_kg;
    if mass_kg == 0.0 {
        return Body { inertia: a.inertia + b.inertia, ..a };
    }
    let centre = (a.centre * a.mass_kg + b.centre * b.mass_kg) / mass_kg;
    let about = |body: Body| {
        let d = body.centre - centre;
        body.inertia + (nalgebra::Matrix3::identity() * d.norm_squared() - d * d.transpose()) * body.mass_kg
    };
    Body { mass_kg, centre, inertia: about(a) + about(b) }
}

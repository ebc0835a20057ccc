//! A design as one JSON object.

use serde::Serialize;
use upright::table::{Law, PerLaw};
use upright_design::design::{Certified, DesignPoles, Laws, Poles, Stilling};
use upright_design::numerics::Matrix;
use upright_design::rig::Rig;
use upright_design::table::TableValues;

/// Matrices are arrays of rows; poles are [re, im]; what was not designed is null.
#[derive(Serialize)]
pub(super) struct DesignData<'a> {
    rig: &'a str,
    hash: String,
    states: usize,
    tick_s: f64,
    delay_ticks: u8,
    plant: PlantData<'a>,
    continuous: LawsData<'a>,
    sampled: SampledData<'a>,
    table: Option<&'a TableValues>,
    /// The law with which the motor stills the links; null if it cannot.
    stilling: Option<Stilling>,
    /// The two precisions (bits) at which all values agreed.
    certified_bits: [usize; 2],
}

#[derive(Serialize)]
#[serde(rename_all = "UPPERCASE")]
struct PlantData<'a> {
    a: Rows<'a>,
    b: Rows<'a>,
}

#[derive(Serialize)]
struct LawsData<'a> {
    lqr: Option<LawData<'a>>,
    pole_placement: Option<LawData<'a>>,
    integral: Option<IntegralData<'a>>,
}

#[derive(Serialize)]
struct SampledData<'a> {
    #[serde(rename = "Ad")]
    ad: Rows<'a>,
    #[serde(rename = "Bd")]
    bd: Rows<'a>,
    #[serde(flatten)]
    laws: LawsData<'a>,
    kalman: Option<KalmanData<'a>>,
}

#[derive(Serialize)]
struct LawData<'a> {
    #[serde(rename = "K")]
    k: Rows<'a>,
    #[serde(rename = "N")]
    n: Option<f64>,
    poles: Option<&'a Poles>,
}

#[derive(Serialize)]
struct IntegralData<'a> {
    /// For [x; z], and for the pending force if there is a delay.
    #[serde(rename = "K")]
    k: Rows<'a>,
    /// The entry of K on z.
    #[serde(rename = "Ki")]
    ki: f64,
    #[serde(rename = "N")]
    n: Option<f64>,
}

#[derive(Serialize)]
struct KalmanData<'a> {
    #[serde(rename = "L_filter")]
    filter: Rows<'a>,
    #[serde(rename = "L_predictor")]
    predictor: Rows<'a>,
}

type Rows<'a> = Vec<&'a [f64]>;

impl<'a> DesignData<'a> {
    pub(super) fn of(
        rig: &'a Rig,
        certified: &'a Certified,
        poles: &'a DesignPoles,
        table: Option<&'a TableValues>,
    ) -> Self {
        let (design, states) = (&certified.double, rig.states());
        Self {
            rig: &rig.name,
            hash: format!("{:016x}", rig.hash()),
            states,
            tick_s: rig.tick.period_s,
            delay_ticks: rig.tick.delay_ticks,
            plant: PlantData { a: rows(&design.a), b: rows(&design.b) },
            continuous: laws(&design.continuous, &poles.continuous, states),
            sampled: SampledData {
                ad: rows(&design.ad),
                bd: rows(&design.bd),
                laws: laws(&design.sampled, &poles.sampled, states),
                kalman: design.kalman.as_ref().map(|kalman| KalmanData {
                    filter: rows(&kalman.l_filter),
                    predictor: rows(&kalman.l_predictor),
                }),
            },
            table,
            stilling: Stilling::of(rig).ok(),
            certified_bits: certified.bits,
        }
    }
}

fn laws<'a>(laws: &'a Laws<f64>, poles: &'a PerLaw<Option<Poles>>, states: usize) -> LawsData<'a> {
    let of = |law: Law| {
        laws.each()[law].map(|gains| LawData { k: rows(&gains.k), n: gains.n, poles: poles[law].as_ref() })
    };
    LawsData {
        lqr: of(Law::Lqr),
        pole_placement: of(Law::PolePlacement),
        integral: laws.integral.as_ref().map(|law| IntegralData {
            k: rows(&law.k),
            ki: law.k[(0, states)],
            n: law.n,
        }),
    }
}

fn rows(matrix: &Matrix<f64>) -> Rows<'_> {
    matrix.row_slices().collect()
}

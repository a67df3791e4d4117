extern crate std;
use std::vec::Vec;
use std::vec;
use super::hop::Reach;
use super::model::{Gains, Model, Policy};
use crate::mission::{Band, Mission};
use crate::placement::spacing::{Hop, receiver_reach};
use crate::sir::{CrossSection, Placement, Sender, Station, square};

#[derive(Clone, Debug)]
pub struct Problem<'a> {
    pub mission: &'a Mission,
    pub free: Mission,
    pub power: Vec<f32>,
    pub lateral: Vec<Band>,
    pub band: Vec<Band>,
    pub kappa: f32,
    pub debug: bool,
}

#[derive(Clone, Debug)]
pub struct Chain {
    pub sigma: f32,
    pub u: Vec<CrossSection>,
    pub x: Vec<f32>,
    pub slack: f32,
    pub merit: f32,
}

impl<'a> Problem<'a> {
    pub fn new(mission: &'a Mission) -> Self {
        let n = usize::from(mission.relays());
        let c = mission.config();
        Self { mission, free: mission.unseparated(), power: vec![c.common.power_w; n], lateral: vec![c.lateral; n], band: vec![c.band; n], kappa: 0.0, debug: false }
    }
    pub fn n(&self) -> usize { self.power.len() }
    fn station(&self, i: usize, u: CrossSection) -> Station { Station { at: u, power_w: self.power[i] } }
    fn sender(&self, i: usize, u: &[CrossSection]) -> Sender {
        if i == 0 { Sender::transmitter(&self.free) } else { Sender::relay(&self.free, self.station(i-1, u[i-1])) }
    }
    fn near(&self, i: usize, c: f32, p: Placement) -> f32 {
        if i == 0 || self.kappa == 0.0 { return 0.0; }
        let m = self.mission.interferer().unwrap();
        let d = self.mission.config().min_separation_m * 1.0005;
        let s = square(m.x_m - p.x_m) + square(m.y_m - p.y_m) + square(p.altitude_m);
        (c * d * d - s).max(0.0)
    }
    fn weight(&self, c: f32) -> f32 {
        let d = self.mission.config().min_separation_m * 1.0005;
        let s = c * d * d;
        self.kappa * self.mission.config().distance_m / (s * s)
    }
    /// rollout with policy from nominal
    pub fn forward(&self, sigma: f32, nominal: &Chain, policy: &[Policy], share: f32) -> Option<Chain> {
        let g = libm::expf(sigma);
        let m = self.free.interferer().unwrap();
        let n = self.n();
        let mut u: Vec<CrossSection> = Vec::new();
        let mut x: Vec<f32> = Vec::new();
        let (mut px, mut pu) = (0.0, CrossSection::on_line(0.0));
        let mut change = [0.0, 0.0, 0.0, sigma - nominal.sigma];
        let mut penalty = 0.0;
        for i in 0..n {
            let w = if policy.is_empty() { nominal.u[i] } else { policy[i].apply(nominal.u[i], share, change, self.lateral[i], self.band[i]) };
            let sender = if i == 0 { Sender::transmitter(&self.free) } else { Sender::relay(&self.free, self.station(i-1, pu)) };
            let hop = Hop::new(&self.free, m, sender, (i+1) as u16, w, 0.0);
            let nx = hop.reach(g, px)?;
            let c = sender.gain.ratio(g);
            let near = self.near(i, c, w.at(nx));
            penalty += 0.5 * self.weight(c) * near * near;
            x.push(nx); u.push(w);
            px = nx; pu = w;
            change = [nx - nominal.x.get(i).copied().unwrap_or(nx), w.y_m - nominal.u[i].y_m, w.altitude_m - nominal.u[i].altitude_m, sigma - nominal.sigma];
        }
        let last = receiver_reach(&self.free, self.station(n-1, u[n-1]), g)?;
        let slack = px - self.free.config().distance_m + last;
        Some(Chain { sigma, u, x, slack, merit: slack - penalty })
    }
    pub fn backward(&self, at: &Chain) -> Option<(Model, Vec<Policy>, Gains)> {
        let g = libm::expf(at.sigma);
        let m = self.free.interferer().unwrap();
        let n = self.n();
        let end = self.free.config().distance_m;
        let k = self.free.receiver_gain(self.power[n-1]);
        let mut model = Model::last(k / g, at.u[n-1])?;
        let mut policies = vec![Policy::default(); n];
        let mut gains = Gains::default();
        for i in (0..n).rev() {
            let from = if i == 0 { Placement::default() } else { at.u[i-1].at(at.x[i-1]) };
            let to = at.u[i].at(at.x[i]);
            let c = self.sender(i, &at.u).gain.ratio(g);
            let near = self.near(i, c, to);
            if near > 0.0 {
                let d = self.mission.config().min_separation_m * 1.0005;
                model.penalise(self.weight(c), near, [2.0*(m.x_m - to.x_m), 2.0*(m.y_m - to.y_m), -2.0*to.altitude_m, c*d*d], c*d*d);
            }
            let reach = if to.x_m >= end * (1.0 - 1e-6) { Reach::FIXED } else { Reach::new(m, c, from, to)? };
            let (before, policy, gain) = model.before(&reach, at.u[i], self.lateral[i], self.band[i]);
            model = before;
            policies[i] = policy;
            gains.linear += gain.linear;
            gains.square += gain.square;
        }
        Some((model, policies, gains))
    }
    /// the root in sigma for fixed u, by bisection
    pub fn root(&self, u: &[CrossSection], lo: f32) -> Option<Chain> {
        let nominal = Chain { sigma: 0.0, u: u.to_vec(), x: vec![], slack: 0.0, merit: 0.0 };
        let f = |s: f32| self.forward(s, &nominal, &[], 0.0).filter(|c| c.merit >= 0.0);
        let tx = crate::sir::first_hop_ceiling(&self.free, u[0].altitude_m) ;
        let p = |i: usize| Placement { x_m: self.free.config().distance_m, y_m: u[i].y_m, altitude_m: u[i].altitude_m };
        let n = self.n();
        let rx = crate::sir::at_receiver(&self.free, p(n-1), self.power[n-1]);
        let mut high = libm::logf(tx.max(1e-30).min(rx)) + 0.01;
        let mut low = high - 30.0;
        let mut best = None;
        if lo > low { if let Some(c) = f(lo) { best = Some(c); low = lo; } else { return None; } }
        for _ in 0..40 {
            let mid = 0.5 * (low + high);
            if let Some(c) = f(mid) { low = mid; best = Some(c); } else { high = mid; }
            if high - low < 1e-6 { break; }
        }
        best
    }
    pub fn climb(&self, start: Chain, iters: usize) -> (Chain, usize) {
        let mut at = start;
        let mut idle = 0;
        let mut used = 0;
        let mut trust: f32 = 0.5;
        for it in 0..iters {
            used = it + 1;
            let Some((model, policy, gains)) = self.backward(&at) else { if self.debug { std::println!("no model"); } break };
            let vs = model.slope[3];
            let vss = model.bend[3][3];
            if !(vs < 0.0) { if self.debug { std::println!("vs {vs}"); } break; }
            // estimate of root now
            let now = at.sigma + at.merit / -vs;
            let mut share = 1.0f32;
            let mut accepted = None;
            while share > 0.01 {
                let gain = gains.linear * share + gains.square * share * share;
                let want = at.merit + gain.max(0.0);
                // solve want + vs d + vss/2 d^2 = 0
                let disc = vs * vs - 2.0 * vss * want;
                let mut d = if disc > 0.0 { -2.0 * want / (vs - libm::sqrtf(disc)) } else { want / -vs };
                if !(d.abs() < trust) { d = trust.copysign(d); }
                if let Some(c) = self.forward(at.sigma + d, &at, &policy, share) {
                    let est = c.sigma + c.merit / -vs;
                    if self.debug { std::println!("  it {it} share {share} d {d:e} slack {:e} -> {:e} est {:e} gain {:e} {:e}", at.merit, c.merit, est - now, gains.linear, gains.square); }
                    if est > now || (est >= now - 1e-7 && c.merit.abs() < at.merit.abs()) { accepted = Some((c, est - now)); break; }
                } else if self.debug { std::println!("  it {it} share {share} d {d:e} none"); }
                share *= 0.35;
            }
            match accepted {
                Some((c, gain)) => { at = c; if gain < 1e-6 { idle += 1; } else { idle = 0; } trust = 0.5; }
                None => { idle += 2; }
            }
            if idle >= 2 { break; }
        }
        (at, used)
    }
    pub fn common(&self, y: f32, h: f32) -> Vec<CrossSection> {
        (0..self.n()).map(|i| CrossSection { y_m: self.lateral[i].nearest(y), altitude_m: self.band[i].nearest(h) }).collect()
    }
    pub fn starts(&self) -> Vec<Vec<CrossSection>> {
        let c = self.mission.config();
        let ys: Vec<f32> = if c.lateral.is_single() { vec![0.0] } else { vec![c.lateral.least_m, 0.5*(c.lateral.least_m + c.lateral.most_m), c.lateral.most_m] };
        let hs: Vec<f32> = if c.band.is_single() { vec![c.band.least_m] } else { vec![c.band.least_m, 0.5*(c.band.least_m + c.band.most_m), c.band.most_m] };
        let mut out = vec![];
        for &y in &ys { for &h in &hs { out.push(self.common(y, h)); } }
        out
    }
    pub fn solve(&self) -> Option<(Chain, usize)> {
        let mut best: Option<(Chain, usize)> = None;
        let mut total = 0;
        for u in self.starts() {
            let Some(start) = self.root(&u, -1e9) else { if self.debug { std::println!("no start"); } continue };
            let s0 = start.sigma;
            let (c, used) = self.climb(start, 60);
            total += used;
            // exact for these u
            if let Some(c) = self.root(&c.u, c.sigma - 0.5) {
                if self.debug { std::println!("start {:?} {} -> {} in {used}", u[0], s0, c.sigma); }
                if best.as_ref().is_none_or(|b| c.sigma > b.0.sigma) { best = Some((c, total)); }
            }
        }
        best.map(|b| (b.0, total))
    }
}

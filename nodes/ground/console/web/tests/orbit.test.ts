// The ground track and the Sun against closed forms and the almanac.

import { expect, test } from "vitest";
import { footprintRadius, orbitThrough, placeAt, subsolar } from "../src/orbit";

const EARTH_DEG_S = (7.2921159e-5 * 180) / Math.PI;

test("an orbit over the equator gains what its rate exceeds the Earth's", () => {
  const rate = 360 / 5700 - EARTH_DEG_S;
  const orbit = orbitThrough({ t: 0, lon: 0, lat: 0 }, { t: 10000, lon: rate * 10, lat: 0 })!;
  const [lon, lat] = placeAt(orbit, 600000);
  expect(lat).toBeCloseTo(0, 9);
  expect(lon).toBeCloseTo(rate * 600, 6);
});

test("an orbit over the poles reaches them a quarter of a turn after the equator", () => {
  const step = 360 / 5700;
  const orbit = orbitThrough({ t: 0, lon: EARTH_DEG_S * 10, lat: -10 * step }, { t: 10000, lon: 0, lat: 0 })!;
  expect(placeAt(orbit, 10000 + (5700 / 4) * 1000)[1]).toBeCloseTo(90, 5);
  const [lon, lat] = placeAt(orbit, 10000 + 5700 * 1000);
  expect(lat).toBeCloseTo(0, 6);
  expect(lon).toBeCloseTo(-EARTH_DEG_S * 5700, 6);
});

test("there is no orbit through one point", () => {
  expect(orbitThrough({ t: 0, lon: 5, lat: 5 }, { t: 0, lon: 5, lat: 5 })).toBeUndefined();
});

test("the Sun stands where the almanac has it", () => {
  // Equinox of 2026: 20 March, 14:46 UTC. Solstice: 21 June, 08:24 UTC, 23.44 deg.
  expect(subsolar(Date.UTC(2026, 2, 20, 14, 46))[1]).toBeCloseTo(0, 1);
  expect(subsolar(Date.UTC(2026, 5, 21, 8, 24))[1]).toBeCloseTo(23.44, 1);
  // The equation of time is -3.2 min at the beginning of the year: the Sun is late.
  expect(subsolar(Date.UTC(2026, 0, 1, 12))[0]).toBeCloseTo(0.85, 1);
});

test("the footprint of a satellite on the horizon is where its tangent touches", () => {
  const radius = footprintRadius(500000, 0);
  expect(Math.cos((radius * Math.PI) / 180)).toBeCloseTo(6378136.6 / 6878136.6, 9);
});

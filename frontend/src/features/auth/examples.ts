import type { Me } from "../../lib/api/client";

/** Somebody who may do everything: signed in in every test that says nothing else. */
export const ME: Me = {
  account_id: "00000000-0000-4000-8000-000000000001",
  username: "ito",
  name: "Ito Mai",
  role: "administrator",
  language: "",
  permissions: [
    "own_account",
    "see_station",
    "stop",
    "operate",
    "diagnose",
    "read_records",
    "write_records",
    "administer",
  ],
  stations: [],
  locked: false,
  enrolling: false,
  second_factor: true,
  password: true,
  openid: null,
  demonstration: false,
  idle_s: 900,
};

/** Somebody who may only read. */
export const VIEWER: Me = {
  ...ME,
  account_id: "00000000-0000-4000-8000-000000000002",
  username: "abe",
  name: "Abe Rin",
  role: "viewer",
  permissions: ["own_account", "see_station", "stop", "read_records"],
};

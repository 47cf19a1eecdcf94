import type { Me } from "../../lib/api/client";

/** An administrator with all permissions. Tests are signed in as this user by default. */
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
  time_zone: "UTC",
};

/** A user with read permissions only. */
export const VIEWER: Me = {
  ...ME,
  account_id: "00000000-0000-4000-8000-000000000002",
  username: "abe",
  name: "Abe Rin",
  role: "viewer",
  permissions: ["own_account", "see_station", "stop", "read_records"],
};

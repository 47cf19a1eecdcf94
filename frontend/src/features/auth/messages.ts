import type { Schemas } from "../../lib/api/client";

export type Role = Schemas["Me"]["role"];

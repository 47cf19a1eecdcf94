import type { components, paths } from "./schema";

export type Schemas = components["schemas"];
export type Patient = Schemas["Patient"];
export type Recording = Schemas["Recording"];
/** An edit of a recording. */
export type Edit =
  | Schemas["Trim"]
  | Schemas["Hold"]
  | Schemas["Scale"]
  | Schemas["Isolate"]
  | Schemas["WarmUp"]
  | Schemas["Stretch"]
  | Schemas["Mirror"]
  | Schemas["GuideScapula"]
  | Schemas["Reteach"]
  | Schemas["Retouch"];
export type Episode = Schemas["Episode"];
export type Assessment = Schemas["Assessment"];
export type Session = Schemas["Session"];
/** Filters of the sessions, combined with "and". */
export type SessionQuery = Omit<
  NonNullable<paths["/api/sessions"]["get"]["parameters"]["query"]>,
  "after" | "limit"
>;
/** A patient whose session can start without the database. */
export type ReadyPatient = Schemas["ReadyPatient"];
export type Run = Schemas["Run"];
export type Check = Schemas["SessionCheck"];
export type Programme = Schemas["ProgrammeDetail"];
export type ProgrammeVersion = Schemas["ProgrammeVersion"];
export type ProgrammeItem = Schemas["ProgrammeItem"];
export type Live = Schemas["Live"];
export type StationInfo = Schemas["StationInfo"];
export type Chart =
  paths["/api/episodes/{episode_id}/progress/{chart}"]["get"]["parameters"]["path"]["chart"];
export type CommandName = keyof Live["refusals"];
/** The signed-in user. */
export type Me = Schemas["Me"];
export type Account = Schemas["Account"];
/** Filters of the audit trail, combined with "and". */
export type AuditQuery = Omit<
  NonNullable<paths["/api/audit"]["get"]["parameters"]["query"]>,
  "after" | "limit"
>;
/** A period, and a station. */
export type SpanQuery = NonNullable<paths["/api/statistics/stops"]["get"]["parameters"]["query"]>;

import { administrationApi } from "./administrationApi";
import { interopApi } from "./interopApi";
import { loginApi } from "./loginApi";
import { recordsApi } from "./recordsApi";
import { sessionsApi } from "./sessionsApi";
import { stationApi } from "./stationApi";

export { client, ProblemError } from "./request";
export type * from "./types";

/** All calls of the page. */
export const api = {
  ...loginApi,
  ...administrationApi,
  ...recordsApi,
  ...sessionsApi,
  ...stationApi,
  ...interopApi,
};

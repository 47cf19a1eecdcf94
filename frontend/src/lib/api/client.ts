import { administrationApi } from "./administrationApi";
import { clinicApi } from "./clinicApi";
import { commissioningApi } from "./commissioningApi";
import { interopApi } from "./interopApi";
import { loginApi } from "./loginApi";
import { questionnairesApi } from "./questionnairesApi";
import { recordsApi } from "./recordsApi";
import { sessionsApi } from "./sessionsApi";
import { stationApi } from "./stationApi";

export { client, ProblemError } from "./request";
export type * from "./types";

/** All calls of the page. */
export const api = {
  ...loginApi,
  ...administrationApi,
  ...clinicApi,
  ...commissioningApi,
  ...recordsApi,
  ...questionnairesApi,
  ...sessionsApi,
  ...stationApi,
  ...interopApi,
};

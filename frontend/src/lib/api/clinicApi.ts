import { client, unwrap } from "./request";
import type { SpanQuery } from "./types";

/** The work of the day, and the clinic's figures. */
export const clinicApi = {
  worklist: () => unwrap(client.GET("/api/worklist")),
  usage: (span: SpanQuery, by: "day" | "week") =>
    unwrap(client.GET("/api/statistics/usage", { params: { query: { ...span, by } } })),
  trackingQuality: (span: SpanQuery) =>
    unwrap(client.GET("/api/statistics/tracking", { params: { query: span } })),
  stopCounts: (span: SpanQuery) => unwrap(client.GET("/api/statistics/stops", { params: { query: span } })),
  outcomes: (span: SpanQuery) => unwrap(client.GET("/api/statistics/outcomes", { params: { query: span } })),
  clinicAdherence: () => unwrap(client.GET("/api/statistics/clinic-adherence")),
  patientAdherence: () => unwrap(client.GET("/api/statistics/adherence")),
  operation: () => unwrap(client.GET("/api/operation")),
};

import { client, startAfter, unwrap } from "./request";
import type { Schemas } from "./types";

/** Commissioning records, and the configuration of the station. */
export const commissioningApi = {
  commissioningStatus: () => unwrap(client.GET("/api/station/commissioning")),
  commissionings: (station: string, after: string | null = null) =>
    unwrap(client.GET("/api/commissionings", { params: { query: { station, ...startAfter(after) } } })),
  commissioning: (commissioning_id: string) =>
    unwrap(client.GET("/api/commissionings/{commissioning_id}", { params: { path: { commissioning_id } } })),
  stationSettings: (station: string, number: number) =>
    unwrap(client.GET("/api/station-settings", { params: { query: { station, number } } })),
  commissioningRun: () => unwrap(client.GET("/api/station/commissioning/run")),
  startCommissioning: (body: Schemas["CommissioningStart"]) =>
    unwrap(client.POST("/api/station/commissioning/run", { body })),
  confirmCommissioning: (body: Schemas["CommissioningConfirmation"]) =>
    unwrap(client.POST("/api/station/commissioning/run/confirm", { body })),
  previewSettings: (config: string) =>
    unwrap(client.POST("/api/station/configuration/preview", { body: { config } })),
  importSettings: (config: string) => unwrap(client.PUT("/api/station/configuration", { body: { config } })),
};

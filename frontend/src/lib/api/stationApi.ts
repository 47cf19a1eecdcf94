import { client, expectSuccess, unwrap } from "./request";
import type { Schemas } from "./types";

/** Longer than the time that the service waits for the device. */
const STOP_TIMEOUT_MS = 4000;

/** The apparatus at this station, and its simulator. */
export const stationApi = {
  driveTrend: () => unwrap(client.GET("/api/station/drive-trend")),
  readyPatients: async () => (await unwrap(client.GET("/api/station/ready-patients"))).items,
  teachingChecklist: (patient_id: string, fixtures: Schemas["TeachRequest"]["fixtures"]) =>
    unwrap(
      client.GET("/api/patients/{patient_id}/teaching-checklist", {
        params: { path: { patient_id }, query: { fixtures } },
      }),
    ),
  teach: (body: Schemas["TeachRequest"]) => unwrap(client.POST("/api/station/teach", { body })),
  takeLease: (take_over: boolean) => unwrap(client.POST("/api/station/lease", { body: { take_over } })),
  releaseLease: () => unwrap(client.DELETE("/api/station/lease")),
  load: (body: Schemas["LoadRequest"]) => unwrap(client.POST("/api/station/load", { body })),
  loadEndFeel: (body: Schemas["EndFeelLoadRequest"]) =>
    unwrap(client.POST("/api/station/load-end-feel", { body })),
  finishTeaching: () => unwrap(client.POST("/api/station/finish-teaching")),
  unload: () => unwrap(client.POST("/api/station/unload")),
  approach: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/approach", { body })),
  play: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/play", { body })),
  setSide: (side: Schemas["Live"]["side"]) => unwrap(client.POST("/api/station/side", { body: { side } })),
  pause: () => unwrap(client.POST("/api/station/pause")),
  reduceRange: () => unwrap(client.POST("/api/station/reduce-range")),
  returnArm: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/return", { body })),
  releaseTorque: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/release-torque", { body })),
  /** Fails after STOP_TIMEOUT_MS, because the user needs the result at once. */
  stop: () =>
    expectSuccess(client.POST("/api/station/stop", { signal: AbortSignal.timeout(STOP_TIMEOUT_MS) })),
  acknowledge: (body: Schemas["SeenState"]) => unwrap(client.POST("/api/station/acknowledge", { body })),
  simulator: () => unwrap(client.GET("/api/simulator")),
  setPedal: (down: boolean) => unwrap(client.POST("/api/simulator/pedal", { body: { down } })),
  setEstop: (pressed: boolean) => unwrap(client.POST("/api/simulator/estop", { body: { pressed } })),
  setEffort: (effort_nm: number) => unwrap(client.POST("/api/simulator/effort", { body: { effort_nm } })),
  guide: (motion_id: string) => unwrap(client.POST("/api/simulator/guide", { body: { motion_id } })),
  uploadMotion: (name: string, csv: string) =>
    unwrap(
      client.POST("/api/simulator/motions", {
        params: { query: { name } },
        body: csv,
        headers: { "Content-Type": "text/csv" },
        bodySerializer: (body) => body,
      }),
    ),
};

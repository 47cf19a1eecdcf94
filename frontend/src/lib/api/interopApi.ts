import { client, unwrap } from "./request";
import type { Schemas } from "./types";

/** Import, export and erasure. Files are sent as bytes; the service decodes them. */
export const interopApi = {
  previewMotion: (patient_id: string, side: "left" | "right", csv: Blob) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/recordings/import/preview", {
        params: { path: { patient_id }, query: { side } },
        body: "",
        headers: { "Content-Type": "text/csv" },
        bodySerializer: () => csv,
      }),
    ),
  importMotion: (
    patient_id: string,
    query: { name: string; side: "left" | "right"; taught_by: string },
    csv: Blob,
  ) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/recordings/import", {
        params: { path: { patient_id }, query },
        body: "",
        headers: { "Content-Type": "text/csv" },
        bodySerializer: () => csv,
      }),
    ),
  importPatients: (affected_side: "left" | "right", resource: Blob) =>
    unwrap(
      client.POST("/api/patients/import/fhir", {
        params: { query: { affected_side } },
        body: {},
        headers: { "Content-Type": "application/fhir+json" },
        bodySerializer: () => resource,
      }),
    ),
  openErasures: () => unwrap(client.GET("/api/erasures")),
  erasures: (patient_id: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/erasures", { params: { path: { patient_id } } })),
  requestErasure: (patient_id: string, body: Schemas["ErasureRequest"]) =>
    unwrap(client.POST("/api/patients/{patient_id}/erasures", { params: { path: { patient_id } }, body })),
  refuseErasure: (erasure_id: string, body: Schemas["ErasureRefusal"]) =>
    unwrap(client.POST("/api/erasures/{erasure_id}/refuse", { params: { path: { erasure_id } }, body })),
  erasePatient: (erasure_id: string, body: Schemas["ErasureConsent"]) =>
    unwrap(client.POST("/api/erasures/{erasure_id}/approve", { params: { path: { erasure_id } }, body })),
};

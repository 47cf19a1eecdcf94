import { client, expectSuccess, startAfter, unwrap } from "./request";
import type { AuditQuery, Schemas } from "./types";

/** Notifications, accounts, audit trail, backups, and access to restricted records. */
export const administrationApi = {
  notifications: () => unwrap(client.GET("/api/notifications")),
  markNotificationsRead: (notification_ids: string[]) =>
    unwrap(client.PUT("/api/notifications/read", { body: { notification_ids } })),
  accounts: () => unwrap(client.GET("/api/accounts")),
  createAccount: (body: Schemas["AccountCreate"]) => unwrap(client.POST("/api/accounts", { body })),
  updateAccount: (account_id: string, body: Schemas["AccountUpdate"]) =>
    unwrap(client.PATCH("/api/accounts/{account_id}", { params: { path: { account_id } }, body })),
  accessTokens: () => unwrap(client.GET("/api/access-tokens")),
  revokeAccessToken: (access_token_id: string) =>
    expectSuccess(
      client.DELETE("/api/access-tokens/{access_token_id}", { params: { path: { access_token_id } } }),
    ),
  resetAccount: (account_id: string, body: Schemas["AccountReset"]) =>
    unwrap(client.POST("/api/accounts/{account_id}/reset", { params: { path: { account_id } }, body })),
  audit: (query: AuditQuery, after: string | null = null, limit?: number) =>
    unwrap(client.GET("/api/audit", { params: { query: { ...query, ...startAfter(after, limit) } } })),
  stationVersions: (station: string) =>
    unwrap(client.GET("/api/station-versions", { params: { query: { station } } })),
  clinicProfile: () => unwrap(client.GET("/api/clinic-profile")),
  changeClinicProfile: (body: Schemas["ClinicProfileUpdate"]) =>
    unwrap(client.PUT("/api/clinic-profile", { body })),
  backups: () => unwrap(client.GET("/api/backups")),
  makeBackup: () => unwrap(client.POST("/api/backups")),
  recordAccess: (patient_id: string) =>
    unwrap(client.GET("/api/patients/{patient_id}/access", { params: { path: { patient_id } } })),
  changeRecordAccess: (patient_id: string, body: Schemas["RecordAccessChange"]) =>
    unwrap(client.PUT("/api/patients/{patient_id}/access", { params: { path: { patient_id } }, body })),
  breakGlass: (patient_id: string, body: Schemas["BreakGlass"]) =>
    unwrap(
      client.POST("/api/patients/{patient_id}/break-glass-accesses", {
        params: { path: { patient_id } },
        body,
      }),
    ),
  breakGlassAccesses: (after: string | null = null) =>
    unwrap(client.GET("/api/break-glass-accesses", { params: { query: startAfter(after) } })),
  reviewBreakGlassAccess: (glass_id: string) =>
    unwrap(client.POST("/api/break-glass-accesses/{glass_id}/review", { params: { path: { glass_id } } })),
};

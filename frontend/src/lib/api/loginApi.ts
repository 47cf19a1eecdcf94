import type { Language } from "../language";
import { client, expectSuccess, unwrap } from "./request";
import type { Schemas } from "./types";

/** Login, the own account, its login sessions and access tokens. */
export const loginApi = {
  me: () => unwrap(client.GET("/api/me")),
  signIn: (body: Schemas["SignIn"]) => unwrap(client.POST("/api/sign-in", { body })),
  signInByLink: (secret: string) => unwrap(client.POST("/api/sign-in/link", { body: { secret } })),
  loginMethods: () => unwrap(client.GET("/api/sign-in")),
  beginOpenId: (to: string) => unwrap(client.POST("/api/sign-in/openid/begin", { body: { to } })),
  signInByOpenId: (body: Schemas["OidcCallback"]) => unwrap(client.POST("/api/sign-in/openid", { body })),
  confirmOpenId: (code: string) => unwrap(client.POST("/api/sign-in/openid/code", { body: { code } })),
  signOut: () => expectSuccess(client.POST("/api/sign-out")),
  setUp: (body: Schemas["SetUp"]) => unwrap(client.POST("/api/set-up", { body })),
  setPassword: (body: Schemas["SetPassword"]) => expectSuccess(client.POST("/api/set-password", { body })),
  lockScreen: () => expectSuccess(client.POST("/api/me/lock")),
  unlock: (password: string) => unwrap(client.POST("/api/me/unlock", { body: { password } })),
  chooseLanguage: (language: Language) => unwrap(client.PUT("/api/me/language", { body: { language } })),
  changePassword: (body: Schemas["ChangePassword"]) =>
    expectSuccess(client.POST("/api/me/password", { body })),
  beginSecondFactor: (password: string | null) =>
    unwrap(client.POST("/api/me/second-factor", { body: { password } })),
  confirmSecondFactor: (code: string) => unwrap(client.PUT("/api/me/second-factor", { body: { code } })),
  removeSecondFactor: (password: string | null, code: string) =>
    expectSuccess(client.DELETE("/api/me/second-factor", { body: { password, code } })),
  loginSessions: () => unwrap(client.GET("/api/me/sign-ins")),
  endLoginSession: (sign_in_id: string, password: string | null) =>
    expectSuccess(
      client.DELETE("/api/me/sign-ins/{sign_in_id}", {
        params: { path: { sign_in_id } },
        body: { password },
      }),
    ),
  ownAccessTokens: () => unwrap(client.GET("/api/me/access-tokens")),
  createAccessToken: (body: Schemas["AccessTokenCreate"]) =>
    unwrap(client.POST("/api/me/access-tokens", { body })),
  revokeOwnAccessToken: (access_token_id: string) =>
    expectSuccess(
      client.DELETE("/api/me/access-tokens/{access_token_id}", { params: { path: { access_token_id } } }),
    ),
};

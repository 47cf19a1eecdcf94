import type { Resources } from "../locales/resources";

declare module "i18next" {
  interface CustomTypeOptions {
    defaultNS: "common";
    resources: Resources;
    strictInterpolationChecks: true;
  }
}

import { LANGUAGE } from "./language";

/** Return the address of the manual in the page's language, or null if the service has no manual installed. */
export function manualAddress(): string | null {
  const installed = document.querySelector<HTMLMetaElement>('meta[name="kata-manual"]')?.content === "yes";
  return installed ? `/docs/manual/${LANGUAGE}/` : null;
}

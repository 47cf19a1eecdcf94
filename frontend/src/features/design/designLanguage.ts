/** The rules of the design language, as docs/explanation/design-language.md explains them. */

export const SPACES = [
  { value: "xs", use: "Between the parts of one thing: an icon and its word, a number and its note." },
  { value: "sm", use: "Between things that belong together, and inside a card." },
  { value: "md", use: "Between cards." },
  { value: "xl", use: "Between the sections of a tab." },
] as const;

export const TYPE_SCALE = [
  { value: "700 1.625rem/1.35", use: "The page's only heading of the first order (size h2)." },
  { value: "700 1.375rem/1.4", use: "A section (size h3)." },
  { value: "700 1.125rem/1.45", use: "A card, and a verdict (size h4)." },
  { value: "700 1.5rem/1.3", use: "A number that is looked for, with digits of equal width." },
  { value: "400 1rem/1.55", use: "Text." },
  {
    value: "400 0.875rem/1.45",
    use: "What explains a number or a field. Nothing is smaller but a scale's ends.",
  },
] as const;

export const COLOUR_ROLES = [
  { value: "--kata-brand", use: "The frame of what names the patient; the place in the navigation." },
  { value: "--kata-setpoint", use: "What was requested, the other shoulder, a session that went well." },
  { value: "--kata-measured", use: "What was measured, the affected shoulder, a session with a stop." },
  { value: "--kata-torque", use: "The ground of the state of a station whose motors hold or move an arm." },
  { value: "--kata-hover", use: "The ground of a number." },
  { value: "--kata-chosen", use: "What is chosen." },
  { value: "--mantine-color-dimmed", use: "What explains. Never what must be read." },
  { value: "--alarm-high", use: "Alarms of high priority and Stop, nothing else (IEC 60601-1-8)." },
  { value: "--alarm-medium", use: "Alarms of medium priority, nothing else." },
  { value: "--alarm-low", use: "Alarms of low priority, nothing else." },
] as const;

export const DENSITY = [
  { value: "44 px", use: "The least height of what is pressed at the apparatus; 88 px for Stop." },
  {
    value: "1 screen",
    use: "What a page is opened for is seen at 1280 x 800 without scrolling; the rest is in tabs.",
  },
  { value: "1 chart", use: "One chart at a time, with a switch. More side by side on request." },
] as const;

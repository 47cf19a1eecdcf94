import { vi } from "vitest";

// Tests load this module in place of Plotly (vite.config.ts), because jsdom cannot draw.

/** The listeners of the figure that was drawn last. */
export const listeners: Record<string, (change: Record<string, unknown>) => void> = {};

/** The element that a drawing returns. */
export const plot = {
  layout: {} as Record<string, unknown>,
  on: (name: string, listener: (change: Record<string, unknown>) => void) => {
    listeners[name] = listener;
  },
  removeAllListeners: () => {},
};

const Plotly = {
  react: vi.fn(
    async (_element: unknown, _data: unknown, layout: Record<string, unknown>, _config: unknown) => {
      layout.written = "by Plotly";
      return plot;
    },
  ),
  register: vi.fn(),
  purge: vi.fn(),
};

export default Plotly;

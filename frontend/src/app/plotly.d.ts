declare module "plotly.js-basic-dist-min" {
  interface PlotElement {
    /** The layout that the figure shows now, including the user's changes. */
    layout: Record<string, unknown>;
    on(name: "plotly_relayout", listener: (change: Record<string, unknown>) => void): void;
    removeAllListeners(name: "plotly_relayout"): void;
  }
  const Plotly: {
    react(
      element: HTMLElement,
      data: unknown[],
      layout: Record<string, unknown>,
      config: Record<string, unknown>,
    ): Promise<PlotElement>;
    register(locale: { moduleType: "locale"; name: string; dictionary: object; format: object }): void;
    purge(element: HTMLElement): void;
  };
  export default Plotly;
}

package example;

import static org.junit.jupiter.api.Assertions.assertEquals;
import static org.junit.jupiter.api.Assertions.assertTrue;

import java.io.ByteArrayOutputStream;
import java.io.EOFException;
import java.io.IOException;
import java.net.Socket;
import java.nio.charset.StandardCharsets;
import org.junit.jupiter.api.AfterAll;
import org.junit.jupiter.api.BeforeAll;
import org.junit.jupiter.api.BeforeEach;
import org.junit.jupiter.api.Test;

/** One robot for the class, a fresh one for each test. */
class CellTest {
    private static RobotContainer robot;

    @BeforeAll
    static void start() {
        robot = new RobotContainer();
    }

    @BeforeEach
    void fresh() throws Exception {
        robot.reset();
    }

    @AfterAll
    static void stop() {
        robot.close();
    }

    /** Your host program: here it sends a command and returns the answer. */
    private static String command(Socket socket, String text) throws IOException, InterruptedException {
        Thread.sleep(51); // the manual asks for 50 ms
        socket.getOutputStream().write(("\u0002" + text + "\r\u0003").getBytes(StandardCharsets.US_ASCII));
        ByteArrayOutputStream answer = new ByteArrayOutputStream();
        for (int next = socket.getInputStream().read(); next != 3; next = socket.getInputStream().read()) {
            if (next < 0) {
                throw new EOFException("the robot closed the connection");
            }
            answer.write(next);
        }
        return answer.toString(StandardCharsets.US_ASCII).substring(1).trim();
    }

    @Test
    void theRobotPlacesAPart() throws Exception {
        robot.call("PUT", "/clock", "{\"mode\":\"stepped\"}");
        robot.call("PUT", "/files/PICK", "{\"text\":\"PROGRAM PICK\\nWAIT DIN(1)\\nDELAY 2\\nDOUT(5)\\nEND\\n\"}");
        try (Socket socket = robot.connect()) {
            for (String text : new String[] {"SO", "SL,PICK", "RN"}) {
                assertEquals("OK", command(socket, text));
            }
            robot.call("PUT", "/inputs/1", "{\"on\":true}");
            String waited = robot.call("POST", "/clock/advance-until", "{\"condition\":\"output 5 on\",\"within\":10}");
            assertTrue(waited.contains("\"reached\":true"), waited);
        }
        assertEquals("[]", robot.findings());
    }

    @Test
    void theEmergencyStopRefusesAStart() throws Exception {
        robot.call("PUT", "/emergency-stop", "{\"pressed\":true}");
        try (Socket socket = robot.connect()) {
            assertEquals("NG", command(socket, "SO"));
        }
    }

    @Test
    void aWrongHostIsNamed() throws Exception {
        try (Socket socket = robot.connect()) {
            assertEquals("NG", command(socket, "XX"));
        }
        assertTrue(robot.findings().contains("\"rule\":\"unknown-command\""), robot.findings());
    }
}
